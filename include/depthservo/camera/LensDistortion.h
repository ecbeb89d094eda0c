#pragma once

#include <Eigen/Core>

#include "depthservo/api.h"

namespace depthservo {

/// Radial and tangential lens distortion, after Brown and Conrady: `plumb_bob` of ROS and OpenCV,
/// `radtan` of Kalibr and EuRoC. With r^2 = x^2 + y^2 and q = 1 + k1 r^2 + k2 r^4 + k3 r^6,
///
///     x_d = q x + 2 p1 x y + p2 (r^2 + 2 x^2)
///     y_d = q y + p1 (r^2 + 2 y^2) + 2 p2 x y
///
/// takes ideal normalised image coordinates to those of the image. The polynomial is a fit to the
/// field of view; beyond the radius `reach()`, where it would fold back, it is continued in
/// proportion to the radius.
///
/// Real-time: no member but the constructor does more than a fixed number of operations.
class DEPTHSERVO_API LensDistortion {
 public:
  LensDistortion() = default;  ///< none
  LensDistortion(double k1, double k2, double p1, double p2, double k3 = 0);

  bool isNone() const { return isNone_; }
  double k1() const { return k1_; }
  double k2() const { return k2_; }
  double p1() const { return p1_; }
  double p2() const { return p2_; }
  double k3() const { return k3_; }

  /// Radius of ideal coordinates up to which the radial polynomial grows; at most 10.
  double reach() const { return reach_; }

  /// Distorted coordinates of ideal ones.
  Eigen::Vector2d distort(const Eigen::Vector2d& ideal) const;

  /// Ideal coordinates of distorted ones: eight steps of Newton's method, to 1e-12 within the
  /// image of any lens whose polynomial does not fold there. Where there is no such point (far
  /// outside the image) the coordinates come back as they are: finite, and `isInvertibleAt` says
  /// so.
  Eigen::Vector2d undistort(const Eigen::Vector2d& distorted) const;
  bool isInvertibleAt(const Eigen::Vector2d& distorted) const;

  /// 2x2 derivative of `distort` by its argument.
  Eigen::Matrix2d J_distorted_ideal(const Eigen::Vector2d& ideal) const;

 private:
  double k1_ = 0, k2_ = 0, p1_ = 0, p2_ = 0, k3_ = 0;
  double reach_ = 10;
  bool isNone_ = true;
};

}  // namespace depthservo
