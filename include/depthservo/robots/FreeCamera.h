#pragma once

#include <cmath>
#include <limits>

#include "depthservo/api.h"
#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo {

/// A camera that moves freely: commands are its own twist (vx, vy, vz, wx, wy, wz) [m/s, rad/s], in
/// its frame. Exact for a constant twist; e is the camera frame. The limits scale all six by a
/// common factor.
class DEPTHSERVO_API FreeCamera : public SimulatedRobot {
 public:
  explicit FreeCamera(const Eigen::Isometry3d& wMc) : wMc_(wMc) { eJe_.eye(6); }

  /// \param velocity greatest |v| of each axis [m/s] \param turnRate of each axis [rad/s]
  void setLimits(double velocity, double turnRate);

  void accelerate(const Velocities& command, double dt) override;
  void move(double dt) override;
  Velocities velocity() const override { return velocity_; }
  Velocities velocityLimits() const override { return limits_; }
  std::vector<std::string> velocityNames() const override {
    return {"vx [m/s]", "vy [m/s]", "vz [m/s]", "wx [rad/s]", "wy [rad/s]", "wz [rad/s]"};
  }
  /// Of the camera; its direction is that of the optical axis.
  Eigen::Vector3d floorPose() const override {
    const Eigen::Vector3d axis = wMc_.linear().col(2);
    return {wMc_.translation().x(), wMc_.translation().y(), std::atan2(axis.y(), axis.x())};
  }
  Mobility mobility() const override { return Mobility::full; }
  Twist cameraTwist(const Velocities& velocity) const override;
  Eigen::Isometry3d wMc() const override { return wMc_; }
  /// The identity, both.
  const DEPTHSERVO_VISP vpMatrix& eJe() const override { return eJe_; }
  const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const override { return cVe_; }

 private:
  Eigen::Isometry3d wMc_;
  DEPTHSERVO_VISP vpMatrix eJe_;
  DEPTHSERVO_VISP vpVelocityTwistMatrix cVe_;
  Vector6d limits_ = Vector6d::Constant(std::numeric_limits<double>::infinity());
  Vector6d velocity_ = Vector6d::Zero();
};

}  // namespace depthservo
