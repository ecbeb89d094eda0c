#include "depthservo/pose/PoseRegulation.h"

#include <algorithm>

namespace depthservo {

PoseRegulation::PoseRegulation(const Eigen::Isometry3d& cdMo, const Options& options)
    : cdMo_(cdMo), oMcd_(cdMo.inverse()), options_(options) {}

Vector6d PoseRegulation::error(const Eigen::Isometry3d& cMo) const {
  return poseError(oMcd_ * cMo);
}

Twist PoseRegulation::command(const Eigen::Isometry3d& cMo) const {
  // Ad(g) (v, w) = (R v + p x R w, R w).
  const Vector6d e = rotated(cdMo_.linear(), error(cMo));
  Twist twist;
  twist.angular = options_.kc * e.tail<3>();
  twist.linear = options_.kc * e.head<3>() + cdMo_.translation().cross(twist.angular);
  if (options_.mobility == Mobility::planar) {
    twist.linear.y() = 0;
    twist.angular.x() = twist.angular.z() = 0;
  }
  const double v = twist.linear.norm(), w = twist.angular.norm();
  if (!std::isfinite(v) || !std::isfinite(w)) return {};
  const double excess = std::max({1.0, v / options_.maxLinear, w / options_.maxAngular});
  twist.linear /= excess;
  twist.angular /= excess;
  return twist;
}

}  // namespace depthservo
