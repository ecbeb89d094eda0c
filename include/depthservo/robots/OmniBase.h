#pragma once

#include <limits>

#include "depthservo/api.h"
#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo {

/// A base that also drives sideways, with a camera whose optical axis is horizontal, simulated
/// without integration error.
///
/// Robot frame e: x forward, y left, z up. The camera sits at (rx, ry, rz) in it, looking forward.
/// Commands are (vx, vy [m/s], w [rad/s]) in the robot frame. The limits scale all three by a
/// common factor.
class DEPTHSERVO_API OmniBase : public SimulatedRobot {
 public:
  struct Pose {
    double x = 0, y = 0;  ///< [m]
    double theta = 0;     ///< counter-clockwise from the world's x axis [rad]
  };

  /// \param offset (rx, ry, rz) [m]
  explicit OmniBase(const Eigen::Vector3d& offset);

  void setPose(const Pose& pose) { pose_ = pose; }
  const Pose& pose() const { return pose_; }

  /// Greatest |vx|, |vy| [m/s] and |w| [rad/s].
  void setLimits(const Eigen::Vector3d& limits) { limits_ = limits; }

  void accelerate(const Velocities& command, double dt) override;
  void move(double dt) override;
  Velocities velocity() const override { return velocity_; }
  Velocities velocityLimits() const override { return limits_; }
  std::vector<std::string> velocityNames() const override {
    return {"vx [m/s]", "vy [m/s]", "w [rad/s]"};
  }
  Eigen::Vector3d floorPose() const override { return {pose_.x, pose_.y, pose_.theta}; }
  Twist cameraTwist(const Velocities& velocity) const override;
  Eigen::Isometry3d wMc() const override;
  const DEPTHSERVO_VISP vpMatrix& eJe() const override { return eJe_; }  ///< 6x3
  const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const override { return cVe_; }

 private:
  Eigen::Vector3d offset_;
  DEPTHSERVO_VISP vpMatrix eJe_;
  DEPTHSERVO_VISP vpVelocityTwistMatrix cVe_;
  Pose pose_;
  Eigen::Vector3d limits_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace depthservo
