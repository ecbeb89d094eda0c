#pragma once

#include <Eigen/Core>

#include "depthservo/motion/Flow.h"

namespace depthservo::detail {

/// Derivative of d(x, y, chi)/dt by a small rotation m of the camera against its assumed mount:
/// du/dm_i = (v x e_i, w x e_i).
/// \param L rateByTwist, 3x6
inline Eigen::Matrix3d byMount(const Eigen::Matrix<double, 3, 6>& L, const Twist& twist) {
  const auto cross = [](const Eigen::Vector3d& a) {
    Eigen::Matrix3d m;
    m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return m;
  };
  return L.leftCols<3>() * cross(twist.linear) + L.rightCols<3>() * cross(twist.angular);
}

/// d(x, y, chi) after a motion by the scale of its translation. \param F flowJacobian, 3x3
inline Eigen::Vector3d byScale(const PointState& before, const Eigen::Matrix3d& F,
                               const PointState& after) {
  return before.chi * F.col(2) - Eigen::Vector3d(0, 0, after.chi);
}

}  // namespace depthservo::detail
