#include "depthservo/robots/UnicycleCamera.h"

#include <cmath>

#include "depthservo/visp/using.h"
#include "robots/forwardCamera.h"
#include "robots/limits.h"
#include "robots/planarArc.h"
#include "visp/pose.h"

namespace depthservo {

UnicycleCamera::UnicycleCamera(const Eigen::Vector3d& offset, double yaw)
    : offset_(offset), yaw_(yaw), eJe_(6, 2, 0.), cVe_(toVisp(wMcAt({}).inverse())) {
  eJe_[0][0] = eJe_[5][1] = 1;
}

Eigen::Isometry3d UnicycleCamera::wMcAt(const Pose& pose) const {
  const double c = std::cos(pose.theta), s = std::sin(pose.theta);
  const Eigen::Vector3d position(pose.x + c * offset_.x() - s * offset_.y(),
                                 pose.y + s * offset_.x() + c * offset_.y(), offset_.z());
  return horizontalCamera(position, pose.theta + yaw_);
}

Twist UnicycleCamera::cameraTwist(const Velocities& velocity) const {
  const double v = velocity[0], w = velocity[1];
  const double forward = v - w * offset_.y(), sideways = w * offset_.x();
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return {{s * forward - c * sideways, 0, c * forward + s * sideways}, {0, -w, 0}};
}

Eigen::Vector2d UnicycleCamera::limited(const Eigen::Vector2d& command, double dt) const {
  const Eigen::Vector2d largest(limits_.v, limits_.w), quickest(limits_.dv * dt, limits_.dw * dt);
  const Eigen::Vector2d change = command * commonFactor(command, largest) - target_;
  return target_ + change * commonFactor(change, quickest);
}

void UnicycleCamera::accelerate(const Velocities& command, double dt) {
  if (!(dt > 0) || !std::isfinite(dt)) return;
  const bool isUsable = command.size() == 2 && command.allFinite();
  target_ = limited(isUsable ? Eigen::Vector2d(command) : Eigen::Vector2d::Zero(), dt);
  const double follow = lag_s_ > 0 ? -std::expm1(-dt / lag_s_) : 1;
  actuators_ += follow * (target_ - actuators_);
  velocity_ = actuators_ + disturbance_;
}

void UnicycleCamera::move(double dt) {
  if (!(dt > 0) || !std::isfinite(dt)) return;
  const double turn = velocity_[1] * dt;
  const Eigen::Vector2d way = planarArc(velocity_[0] * dt, turn, pose_.theta);
  pose_.x += way.x();
  pose_.y += way.y();
  pose_.theta += turn;
}

}  // namespace depthservo
