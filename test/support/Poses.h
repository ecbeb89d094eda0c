#pragma once

#include <Eigen/Geometry>

namespace depthservo::test {

/// \param translation [m] \param rotation axis times angle [rad]
inline Eigen::Isometry3d poseAt(const Eigen::Vector3d& translation,
                                const Eigen::Vector3d& rotation = {0, 0, 0}) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (rotation.norm() > 0) {
    pose.linear() = Eigen::AngleAxisd(rotation.norm(), rotation.normalized()).matrix();
  }
  pose.translation() = translation;
  return pose;
}

}  // namespace depthservo::test
