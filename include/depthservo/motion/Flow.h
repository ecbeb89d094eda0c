#pragma once

#include <Eigen/Core>

#include "depthservo/motion/Motion.h"

namespace depthservo {

/// A point as an image-based method sees it.
struct PointState {
  double x = 0, y = 0;  ///< normalised image coordinates X/Z, Y/Z [-]
  double chi = 0;       ///< inverse depth 1/Z [1/m]; 0 is a point at infinity
};

/// Where a motion takes a point.
struct Flow {
  PointState point;    ///< after the motion; the input, unchanged, when `ahead` is false
  bool ahead = false;  ///< false: it has passed behind the camera, or the input is not finite
};

/// Exact flow of (x, y, chi) under a motion of the camera past a still point: with m = (x, y, 1),
///     q = R m + t chi,   x' = q1/q3,   y' = q2/q3,   chi' = chi/q3.
/// No integration error at any frame rate, no division by chi. \rtsafe
inline Flow flow(const Motion& motion, const PointState& p) {
  const Eigen::Matrix3d& R = motion.R;
  const Eigen::Vector3d& t = motion.t;
  const double q1 = R(0, 0) * p.x + R(0, 1) * p.y + R(0, 2) + t(0) * p.chi;
  const double q2 = R(1, 0) * p.x + R(1, 1) * p.y + R(1, 2) + t(1) * p.chi;
  const double q3 = R(2, 0) * p.x + R(2, 1) * p.y + R(2, 2) + t(2) * p.chi;
  const double scale = 1 / q3;
  const PointState next{q1 * scale, q2 * scale, p.chi * scale};
  // One comparison refuses q3 <= 0, NaN, and an overflow of any component.
  constexpr double kLargest = 1e150;
  const double size = std::abs(next.x) + std::abs(next.y) + std::abs(next.chi);
  if (!(q3 > 0 && size < kLargest)) return {p, false};
  return {next, true};
}

/// Derivative of `flow` along a direction (dx, dy, dchi) of the point before, given its result:
/// (rate x, rate y, rate chi) of the point after. \rtsafe
inline Eigen::Vector3d flowDerivative(const Motion& motion, const PointState& before,
                                      const PointState& after, const Eigen::Vector3d& direction) {
  const Eigen::Matrix3d& R = motion.R;
  const Eigen::Vector3d& t = motion.t;
  const double scale = 1 / (R(2, 0) * before.x + R(2, 1) * before.y + R(2, 2) + t(2) * before.chi);
  const double dx = direction.x(), dy = direction.y(), dchi = direction.z();
  const double dq1 = R(0, 0) * dx + R(0, 1) * dy + t(0) * dchi;
  const double dq2 = R(1, 0) * dx + R(1, 1) * dy + t(1) * dchi;
  const double dq3 = R(2, 0) * dx + R(2, 1) * dy + t(2) * dchi;
  return {scale * (dq1 - after.x * dq3), scale * (dq2 - after.y * dq3),
          scale * (dchi - after.chi * dq3)};
}

/// J_after_before: 3x3, rows and columns (x, y, chi): the derivative of `flow`, given its result.
///     row x = ((R11, R12, t1) - x' g)/q3,  row y = ((R21, R22, t2) - y' g)/q3,
///     row chi = ((0, 0, 1) - chi' g)/q3,   g = (R31, R32, t3). \rtsafe
inline Eigen::Matrix3d flowJacobian(const Motion& motion, const PointState& before,
                                    const PointState& after) {
  const Eigen::Matrix3d& R = motion.R;
  const Eigen::Vector3d& t = motion.t;
  const double scale = 1 / (R(2, 0) * before.x + R(2, 1) * before.y + R(2, 2) + t(2) * before.chi);
  Eigen::Matrix3d J;
  J << R(0, 0) - after.x * R(2, 0), R(0, 1) - after.x * R(2, 1), t(0) - after.x * t(2),  //
      R(1, 0) - after.y * R(2, 0), R(1, 1) - after.y * R(2, 1), t(1) - after.y * t(2),   //
      -after.chi * R(2, 0), -after.chi * R(2, 1), 1 - after.chi * t(2);
  return scale * J;
}

}  // namespace depthservo
