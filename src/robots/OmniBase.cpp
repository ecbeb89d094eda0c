#include "depthservo/robots/OmniBase.h"

#include "depthservo/visp/using.h"
#include "robots/forwardCamera.h"
#include "robots/limits.h"
#include "robots/planarArc.h"

namespace depthservo {
namespace {

constexpr double kHalfPi = 1.57079632679489661923;

}  // namespace

OmniBase::OmniBase(const Eigen::Vector3d& offset)
    : offset_(offset), eJe_(6, 3, 0.), cVe_(forwardCameraTwistMatrix(offset)) {
  eJe_[0][0] = eJe_[1][1] = eJe_[5][2] = 1;
}

Eigen::Isometry3d OmniBase::wMc() const {
  const double c = std::cos(pose_.theta), s = std::sin(pose_.theta);
  const Eigen::Vector3d position(pose_.x + c * offset_.x() - s * offset_.y(),
                                 pose_.y + s * offset_.x() + c * offset_.y(), offset_.z());
  return horizontalCamera(position, pose_.theta);
}

Twist OmniBase::cameraTwist(const Velocities& velocity) const {
  const double w = velocity[2];
  const double forward = velocity[0] - w * offset_.y(), left = velocity[1] + w * offset_.x();
  return {{-left, 0, forward}, {0, -w, 0}};
}

void OmniBase::accelerate(const Velocities& command, double /*dt*/) {
  const bool isUsable = command.size() == 3 && command.allFinite();
  velocity_ = isUsable ? Eigen::Vector3d(command) : Eigen::Vector3d::Zero();
  velocity_ *= commonFactor(velocity_, limits_);
}

void OmniBase::move(double dt) {
  const double turn = velocity_[2] * dt;
  const Eigen::Vector2d step = planarArc(velocity_[0] * dt, turn, pose_.theta) +
                               planarArc(velocity_[1] * dt, turn, pose_.theta + kHalfPi);
  pose_.x += step.x();
  pose_.y += step.y();
  pose_.theta += turn;
}

}  // namespace depthservo
