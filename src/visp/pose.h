#pragma once

#include <visp3/core/vpHomogeneousMatrix.h>

#include <Eigen/Geometry>

#include "depthservo/visp/visp.h"

namespace depthservo {

inline DEPTHSERVO_VISP vpHomogeneousMatrix toVisp(const Eigen::Isometry3d& M) {
  DEPTHSERVO_VISP vpHomogeneousMatrix visp;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 4; ++j) visp[i][j] = M.matrix()(i, j);
  }
  return visp;
}

}  // namespace depthservo
