#pragma once

#include <Eigen/Core>
#include <cmath>

namespace depthservo {

/// Intrinsic parameters of a camera without distortion. Pixel (0, 0) is the centre of the first
/// pixel, u to the right, v down.
struct PinholeCamera {
  int width = 0, height = 0;  ///< [px]
  double fx = 0, fy = 0;  ///< focal lengths [px]; a negative fy means v up, as in some data sets
  double cx = 0, cy = 0;  ///< principal point [px]

  /// Normalised image coordinates (x, y) of the pixel (u, v).
  Eigen::Vector2d normalise(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy}; }

  /// Pixel (u, v) of normalised image coordinates.
  Eigen::Vector2d toPixel(double x, double y) const { return {fx * x + cx, fy * y + cy}; }

  /// Factor between a standard deviation in pixels and one in normalised coordinates [px].
  double focal_px() const { return std::sqrt(std::abs(fx * fy)); }

  /// Whether (u, v) lies at least `margin_px` within the image.
  bool contains(double u, double v, double margin_px = 0) const {
    return u >= margin_px - 0.5 && v >= margin_px - 0.5 && u <= width - 0.5 - margin_px &&
           v <= height - 0.5 - margin_px;
  }
};

}  // namespace depthservo
