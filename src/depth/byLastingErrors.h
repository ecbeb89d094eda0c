#pragma once

#include <Eigen/Core>

#include "depthservo/motion/Flow.h"

namespace depthservo::detail {

/// Derivative of d(x, y, chi)/dt by a small rotation m of the camera against its assumed mount:
/// du/dm_i = (v x e_i, w x e_i).
/// \param L rateByTwist, or that of another state: N x 6
template <int N>
Eigen::Matrix<double, N, 3> byMount(const Eigen::Matrix<double, N, 6>& L, const Twist& twist) {
  const Eigen::Vector3d &v = twist.linear, &w = twist.angular;
  Eigen::Matrix<double, N, 3> m;  // each row of L, by its halves, x v and x w
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    m.col(i) = L.col(j) * v[k] - L.col(k) * v[j] + L.col(3 + j) * w[k] - L.col(3 + k) * w[j];
  }
  return m;
}

/// d(x, y, chi) after a motion by the scale of its translation. \param F flowJacobian, 3x3
inline Eigen::Vector3d byScale(const PointState& before, const Eigen::Matrix3d& F,
                               const PointState& after) {
  return before.chi * F.col(2) - Eigen::Vector3d(0, 0, after.chi);
}

}  // namespace depthservo::detail
