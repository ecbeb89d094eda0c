#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "depthservo/motion/Twist.h"

namespace depthservo {

/// Size of a pose as an error, after Ibuki et al. 2023: vec(g) = (p ; sk(R)^v), position [m] and
/// xi sin(theta) of the rotation by theta about xi. Its rotation part grows up to theta = pi/2 and
/// is zero again at pi. Finite input gives finite output. \rtsafe
inline Vector6d poseError(const Eigen::Isometry3d& g) {
  const auto R = g.linear();
  Vector6d e;
  e << g.translation(), 0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)),
      0.5 * (R(1, 0) - R(0, 1));
  return e;
}

/// E(g) = |p|^2/2 + 1 - cos(theta): at least |vec(g)|^2/2, and monotone up to theta = pi. \rtsafe
inline double poseEnergy(const Eigen::Isometry3d& g) {
  return 0.5 * g.translation().squaredNorm() + 0.5 * (3 - g.linear().trace());
}

/// Ad(R) x = (R v ; R w): a twist in other axes, about the same point. \rtsafe
inline Vector6d rotated(const Eigen::Matrix3d& R, const Vector6d& x) {
  Vector6d y;
  y << R * x.head<3>(), R * x.tail<3>();
  return y;
}

}  // namespace depthservo
