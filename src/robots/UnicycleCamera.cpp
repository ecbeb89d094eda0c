#include "depthservo/robots/UnicycleCamera.h"

#include <visp3/core/vpHomogeneousMatrix.h>

#include <algorithm>
#include <cmath>

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

/// Factor that brings both values within their limits: 1 or less.
double commonFactor(const Eigen::Vector2d& values, double limit0, double limit1) {
  double factor = 1;
  if (std::abs(values[0]) > limit0) factor = limit0 / std::abs(values[0]);
  if (std::abs(values[1]) * factor > limit1) factor = limit1 / std::abs(values[1]);
  return factor;
}

double sinc(double a) { return std::abs(a) < 1e-4 ? 1 - a * a / 6 : std::sin(a) / a; }

}  // namespace

UnicycleCamera::UnicycleCamera(const Eigen::Vector3d& offset, double yaw)
    : offset_(offset), yaw_(yaw) {
  const Eigen::Isometry3d eMc = wMcAt({});
  vpHomogeneousMatrix M;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 4; ++j) M[i][j] = eMc.matrix()(i, j);
  }
  set_cMe(M.inverse());
  vpMatrix J(6, 2, 0.);
  J[0][0] = 1;
  J[5][1] = 1;
  set_eJe(J);
}

Eigen::Isometry3d UnicycleCamera::wMcAt(const Pose& pose) const {
  const double a = pose.theta + yaw_;
  Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
  wMc.linear() << std::sin(a), 0, std::cos(a),  //
      -std::cos(a), 0, std::sin(a),             //
      0, -1, 0;
  const double c = std::cos(pose.theta), s = std::sin(pose.theta);
  wMc.translation() << pose.x + c * offset_.x() - s * offset_.y(),
      pose.y + s * offset_.x() + c * offset_.y(), offset_.z();
  return wMc;
}

Twist UnicycleCamera::cameraTwist(const Eigen::VectorXd& velocity) const {
  const double v = velocity[0], w = velocity[1];
  const double forward = v - w * offset_.y(), sideways = w * offset_.x();
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return {{s * forward - c * sideways, 0, c * forward + s * sideways}, {0, -w, 0}};
}

Eigen::Vector2d UnicycleCamera::limited(const Eigen::Vector2d& command, double dt) const {
  const Eigen::Vector2d wanted = command * commonFactor(command, limits_.v, limits_.w);
  const Eigen::Vector2d change = wanted - target_;
  return target_ + change * commonFactor(change, limits_.dv * dt, limits_.dw * dt);
}

Eigen::VectorXd UnicycleCamera::drive(const Eigen::VectorXd& command, double dt) {
  const bool isUsable = command.size() == 2 && command.allFinite();
  target_ = limited(isUsable ? Eigen::Vector2d(command) : Eigen::Vector2d::Zero(), dt);
  const double follow = lag_s_ > 0 ? -std::expm1(-dt / lag_s_) : 1;
  actuators_ += follow * (target_ - actuators_);
  velocity_ = actuators_ + disturbance_;
  // Exact arc: the chord of length v dt sinc(w dt / 2) in the mean direction.
  const double half = 0.5 * velocity_[1] * dt;
  const double chord = velocity_[0] * dt * sinc(half);
  pose_.x += chord * std::cos(pose_.theta + half);
  pose_.y += chord * std::sin(pose_.theta + half);
  pose_.theta += velocity_[1] * dt;
  return velocity_;
}

}  // namespace depthservo
