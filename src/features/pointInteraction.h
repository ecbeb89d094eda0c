#pragma once

#include "motion/rateByTwist.h"

namespace depthservo {

/// Interaction matrix of a point (2x6): rows x and y, columns (vx, vy, vz, wx, wy, wz).
inline Eigen::Matrix<double, 2, 6> pointInteraction(const PointState& p) {
  return rateByTwist(p).topRows<2>();
}

}  // namespace depthservo
