#pragma once

#include <visp3/core/vpImage.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "depthservo/motion/OdometryRow.h"
#include "depthservo/observation/Exposure.h"
#include "depthservo/rig/SimulatedRigOptions.h"
#include "depthservo/robots/SimulatedRobot.h"
#include "depthservo/robots/UnicycleCamera.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/PointTracker.h"
#include "rig/NoiseStream.h"
#include "robots/makeRobot.h"

namespace depthservo {

/// The simulated side of a options: robot, plate, camera and odometry. It knows the truth and
/// hands out what sensors would. The robot knows where the camera is assumed to be; the true one
/// may be turned against it.
class World {
 public:
  /// \param options of one robot: see drawnRobot
  explicit World(const SimulatedRigOptions& options);

  double time() const { return time_s_; }

  /// Lets the robot follow the command, and the target its profile, until this time [s]. Odometry
  /// rows that begin on the way are appended to `odometry()`. \param beforeRow called when one
  /// begins, may give another command
  void advanceTo(double time_s, const std::function<void()>& beforeRow = {});
  void setCommand(const Velocities& command);

  /// All rows so far, as the odometry's `rows` have it.
  const std::vector<OdometryRow>& odometry() const { return odometry_; }

  std::vector<TruePoint> truth() const { return seenAt(cMo()); }
  void truth(std::vector<TruePoint>& points) const { seeAt(cMo(), points); }

  /// Pose of the true camera in the world now.
  Eigen::Isometry3d wMc() const { return truly(robot_->wMc()); }

  /// Pose of the target in the camera now.
  Eigen::Isometry3d cMo() const { return wMc().inverse() * wMo_; }

  /// The same from the goal, which the options must have, with the target where it is.
  Eigen::Isometry3d cdMo() const;
  std::vector<TruePoint> goal() const;

  /// See SimulatedRig.
  void lookFrom(const RobotPose& pose, DEPTHSERVO_VISP vpImage<unsigned char>& image);
  std::vector<std::optional<Eigen::Vector3d>> seenFrom(
      const RobotPose& pose, const std::vector<Eigen::Vector2d>& pixels) const;

  /// Takes the image of this moment (source: image). A tag is hidden as a whole when one of its
  /// corners is.
  void expose(DEPTHSERVO_VISP vpImage<unsigned char>& image);

  /// Measures the points of this moment (source: geometry); hidden ones are missing.
  /// \param points as `truth()` has them
  void measure(const std::vector<TruePoint>& points, std::vector<TrackedPoint>& measured);

  const SimulatedRobot& robot() const { return *robot_; }

 private:
  /// The true camera where this is the one assumed.
  Eigen::Isometry3d truly(const Eigen::Isometry3d& wMa) const {
    return mount_ ? wMa * *mount_ : wMa;
  }
  Eigen::Isometry3d cMoFrom(const RobotPose& pose) const {
    return truly(makeRobot(options_.robot, pose)->wMc()).inverse() * wMo_;
  }
  std::vector<TruePoint> seenAt(const Eigen::Isometry3d& cMo) const {
    std::vector<TruePoint> points;
    seeAt(cMo, points);
    return points;
  }
  void seeAt(const Eigen::Isometry3d& cMo, std::vector<TruePoint>& points) const;
  const std::vector<Eigen::Vector2d>& pixelErrors();
  Eigen::Vector2d shiftByReadout(std::size_t point) const;
  bool isHidden(std::size_t point) const;
  int takenFor(int point) const;
  bool isWithin(const std::vector<Interlude>& spans) const;
  Velocities followed() const;
  void printTags(SyntheticView& view) const;
  void printBoard(SyntheticView& view) const;
  void print(SyntheticView& view, std::size_t first, std::size_t count,
             const std::array<std::size_t, 4>& outer, std::size_t patches) const;
  void takeCommands();
  void moveTarget(double until_s);
  Twist targetTwist(double time_s) const;
  Twist twistRelativeToTarget() const;
  Eigen::Vector2d rolled(double duration_s) const;
  Twist told() const;
  Twist meanTwist();
  Twist counted(const Twist& twist, const Eigen::Vector2d& wheels, double duration_s);
  void addRow(Twist twist);
  Eigen::Vector2d gaussian2() { return {gaussian_(random_), gaussian_(random_)}; }

  SimulatedRigOptions options_;
  std::unique_ptr<SimulatedRobot> robot_;
  UnicycleCamera* unicycle_;  // the robot, if it is one: it has wheels that count and slip
  SyntheticCamera camera_;
  std::optional<Eigen::Quaterniond>
      mount_;  // of the true camera in the one assumed; none: as it is
  Eigen::Isometry3d wMo_;
  std::mt19937_64 random_;
  std::normal_distribution<double> gaussian_;
  NoiseStream gyroNoise_;
  LastingNoise slip_, wander_;
  double time_s_ = 0, lastRow_s_ = 0;
  std::uint64_t images_ = 0, rows_ = 0, looks_ = 0;
  struct Command {
    double from_s;
    Velocities velocities;
  };
  std::vector<Command> underway_;  // to the drives, which have a dead time
  Velocities command_;
  Eigen::Vector2d disturbance_ = Eigen::Vector2d::Zero();  // of (v, w)
  Eigen::Vector2d wheels_ = Eigen::Vector2d::Zero();  // way of the left and of the right one [m]
  Eigen::Vector2d wheelsAtRow_ = Eigen::Vector2d::Zero();  // as the rows have told it
  Twist way_;  // integral of the twist since the last row
  std::vector<OdometryRow> odometry_;
  std::vector<Eigen::Vector2d> pixelErrors_;
};

}  // namespace depthservo
