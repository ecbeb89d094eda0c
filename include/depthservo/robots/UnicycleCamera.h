#pragma once

#include <limits>

#include "depthservo/api.h"
#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo {

/// Limits of a unicycle; infinite by default.
struct UnicycleLimits {
  double v = std::numeric_limits<double>::infinity();   ///< speed [m/s]
  double w = std::numeric_limits<double>::infinity();   ///< turn rate [rad/s]
  double dv = std::numeric_limits<double>::infinity();  ///< acceleration [m/s^2]
  double dw = std::numeric_limits<double>::infinity();  ///< angular acceleration [rad/s^2]
};

/// A unicycle with a camera whose optical axis is horizontal, simulated without integration error.
///
/// Robot frame e: in the middle of the wheel axle, x forward, y left, z up. The camera sits at (rx,
/// ry, rz) in it, turned by the yaw phi about z (0: looking forward). Commands are (v [m/s], w
/// [rad/s]). Camera twist (De Luca, Oriolo, Robuffo Giordano 2008, sec. 6):
///     vx = sin phi (v - w ry) - cos phi w rx,   vz = cos phi (v - w ry) + sin phi w rx,   wy = -w.
/// The limits scale v and w by a common factor, so the path keeps its curvature.
class DEPTHSERVO_API UnicycleCamera : public SimulatedRobot {
 public:
  /// Pose of the robot in the world.
  struct Pose {
    double x = 0, y = 0;  ///< [m]
    double theta = 0;     ///< counter-clockwise from the world's x axis [rad]
  };

  /// \param offset (rx, ry, rz) [m] \param yaw phi, counter-clockwise [rad]
  explicit UnicycleCamera(const Eigen::Vector3d& offset, double yaw = 0);

  void setPose(const Pose& pose) { pose_ = pose; }
  const Pose& pose() const { return pose_; }

  void setLimits(const UnicycleLimits& limits) { limits_ = limits; }

  /// Time constant of the first-order actuators [s]; 0 (default): immediate.
  void setLag(double lag_s) { lag_s_ = lag_s; }

  /// Slip: velocities (v, w) added to what the actuators do, from now on.
  void setDisturbance(const Eigen::Vector2d& disturbance) { disturbance_ = disturbance; }

  void accelerate(const Velocities& command, double dt) override;
  void move(double dt) override;
  Velocities velocity() const override { return velocity_; }
  Velocities velocityLimits() const override { return Eigen::Vector2d(limits_.v, limits_.w); }
  std::vector<std::string> velocityNames() const override { return {"v [m/s]", "w [rad/s]"}; }
  Eigen::Vector3d floorPose() const override { return {pose_.x, pose_.y, pose_.theta}; }
  Twist cameraTwist(const Velocities& velocity) const override;
  Eigen::Isometry3d wMc() const override { return wMcAt(pose_); }
  const DEPTHSERVO_VISP vpMatrix& eJe() const override { return eJe_; }
  const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const override { return cVe_; }

  /// Pose of the camera when the robot is at `pose`.
  Eigen::Isometry3d wMcAt(const Pose& pose) const;

 private:
  Eigen::Vector2d limited(const Eigen::Vector2d& command, double dt) const;

  Eigen::Vector3d offset_;
  double yaw_;
  Pose pose_;
  UnicycleLimits limits_;
  double lag_s_ = 0;
  Eigen::Vector2d target_ = Eigen::Vector2d::Zero();     // what the actuators follow
  Eigen::Vector2d actuators_ = Eigen::Vector2d::Zero();  // what they do
  Eigen::Vector2d disturbance_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  DEPTHSERVO_VISP vpMatrix eJe_;
  DEPTHSERVO_VISP vpVelocityTwistMatrix cVe_;
};

}  // namespace depthservo
