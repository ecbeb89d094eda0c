#include "depthservo/motion/RpyPose.h"

#include <cmath>

namespace depthservo {

Eigen::Isometry3d RpyPose::isometry() const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = xyz;
  return pose;
}

RpyPose RpyPose::of(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d R = pose.linear();
  const double across = std::hypot(R(0, 0), R(1, 0));
  const bool isVertical = across < 1e-9;
  return {pose.translation(),
          {isVertical ? std::atan2(-R(1, 2), R(1, 1)) : std::atan2(R(2, 1), R(2, 2)),
           std::atan2(-R(2, 0), across), isVertical ? 0 : std::atan2(R(1, 0), R(0, 0))}};
}

}  // namespace depthservo
