#pragma once

#include <Eigen/Core>
#include <cmath>

#include "depthservo/motion/Motion.h"

namespace depthservo {

/// Where a motion of the camera takes a plane 1/Z = A x + B y + C.
struct PlaneFlow {
  Eigen::Vector3d abc;  ///< after the motion
  Eigen::Matrix3d J;    ///< its derivative by the plane before
  bool isAhead;         ///< false: the camera has passed through the plane
};

/// Exact: a point p of the plane has n'p = 1, n = (A, B, C), so after p' = R p + t
///     n' = R n / (1 + t'R n). \rtsafe
inline PlaneFlow planeFlow(const Motion& motion, const Eigen::Vector3d& abc) {
  const Eigen::Vector3d turned = motion.R * abc;
  const double q = 1 + motion.t.dot(turned);
  const Eigen::Vector3d next = turned / q;
  const Eigen::Matrix3d J = (motion.R - next * (motion.t.transpose() * motion.R)) / q;
  return {next, J, q > 0 && next.squaredNorm() < 1e150};
}

}  // namespace depthservo
