#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/rig/Rig.h"
#include "depthservo/rig/SimulatedRigOptions.h"

namespace depthservo {

/// A simulated robot before its target, through synthetic images or exact projection. Its images
/// may be jittered, late, or lost on their way; its odometry as bad as the options say.
class DEPTHSERVO_API SimulatedRig : public Rig {
 public:
  /// \param place of the options, for messages \throw InputError they cannot be simulated
  explicit SimulatedRig(const SimulatedRigOptions& options, const std::string& place = "");
  ~SimulatedRig() override;

  const ObservedSource& source() const override;
  std::optional<Exposure> next(Listener* listener) override;
  void giveBack(Exposure exposure) override;
  void readOdometry(MotionBuffer& odometry, double time_s) override;
  const std::vector<OdometryRow>& odometry() const override;
  void command(const Velocities& velocities) override;
  const RobotModel* robot() const override;
  void describe(FrameRecord& frame) const override;
  double time() const override;
  bool isTargetMoving() const override;
  std::string whyEnded() const override;

  std::vector<TruePoint> truth() const;  ///< of the points now
  std::vector<TruePoint> truthAtGoal()
      const;                       ///< seen from robot.goal, which the options must have
  Eigen::Isometry3d cdMo() const;  ///< pose of the target in the camera there
  Eigen::Isometry3d cMo() const;   ///< the same where the camera is now

  /// What the camera sees from another pose of the robot, before walls; with the noise of an image
  /// that is not among those of the run.
  void lookFrom(const RobotPose& pose, DEPTHSERVO_VISP vpImage<unsigned char>& image);
  /// Where in the object frame that is what it sees at a pixel; none: no wall. \param pixels (u, v)
  std::vector<std::optional<Eigen::Vector3d>> seenFrom(
      const RobotPose& pose, const std::vector<Eigen::Vector2d>& pixels) const;
  /// The points of the target, by the image in which they were shown. Before the rig is observed.
  void teach(std::shared_ptr<const TaughtImage> taught);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
