#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace depthservo {

/// An ellipse in the image: the points p with (p - centre)^T shape^-1 (p - centre) = 1.
struct Ellipse {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< (u, v) [px]
  Eigen::Matrix2d shape = Eigen::Matrix2d::Zero();   ///< 2x2, symmetric, positive definite [px^2]

  double area() const { return M_PI * std::sqrt(shape.determinant()); }  ///< [px^2]

  /// (major, minor) [px].
  Eigen::Vector2d semiAxes() const {
    const double mean = 0.5 * shape.trace();
    const double half = std::hypot(0.5 * (shape(0, 0) - shape(1, 1)), shape(0, 1));
    return {std::sqrt(mean + half), std::sqrt(std::max(0.0, mean - half))};
  }
};

}  // namespace depthservo
