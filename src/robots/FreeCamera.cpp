#include "depthservo/robots/FreeCamera.h"

#include "depthservo/motion/Motion.h"
#include "depthservo/visp/using.h"
#include "robots/limits.h"

namespace depthservo {

void FreeCamera::setLimits(double velocity, double turnRate) {
  limits_.head<3>().setConstant(velocity);
  limits_.tail<3>().setConstant(turnRate);
}

Twist FreeCamera::cameraTwist(const Velocities& velocity) const {
  return {velocity.head<3>(), velocity.tail<3>()};
}

void FreeCamera::accelerate(const Velocities& command, double /*dt*/) {
  const bool isUsable = command.size() == 6 && command.allFinite();
  velocity_ = isUsable ? Vector6d(command) : Vector6d::Zero();
  velocity_ *= commonFactor(velocity_, limits_);
}

void FreeCamera::move(double dt) {
  const Motion back = Motion::fromTwist(cameraTwist(velocity_), dt).inverse();
  wMc_.translation() += wMc_.linear() * back.t;
  wMc_.linear() = Eigen::Quaterniond(wMc_.linear() * back.R).normalized().toRotationMatrix();
}

}  // namespace depthservo
