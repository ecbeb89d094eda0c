#pragma once

#include <Eigen/Core>

#include "depthservo/motion/Flow.h"

namespace depthservo {

/// L: derivative of d(x, y, chi)/dt by the camera's twist, 3x6.
inline Eigen::Matrix<double, 3, 6> rateByTwist(const PointState& p) {
  const auto& [x, y, chi] = p;
  Eigen::Matrix<double, 3, 6> L;
  L << -chi, 0, x * chi, x * y, -(1 + x * x), y,  //
      0, -chi, y * chi, 1 + y * y, -x * y, -x,    //
      0, 0, chi * chi, chi * y, -chi * x, 0;
  return L;
}

}  // namespace depthservo
