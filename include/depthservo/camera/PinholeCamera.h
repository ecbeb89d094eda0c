#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

#include "depthservo/camera/LensDistortion.h"

namespace depthservo {

/// Intrinsic parameters of a camera. Pixel (0, 0) is the centre of the first pixel, u to the right,
/// v down.
struct PinholeCamera {
  int width = 0, height = 0;  ///< [px]
  double fx = 0, fy = 0;  ///< focal lengths [px]; a negative fy means v up, as in some data sets
  double cx = 0, cy = 0;  ///< principal point [px]
  LensDistortion distortion{};  ///< none by default

  /// Normalised image coordinates (x, y) of the pixel (u, v), freed from the lens distortion.
  Eigen::Vector2d normalise(double u, double v) const {
    return distortion.undistort({(u - cx) / fx, (v - cy) / fy});
  }

  /// Pixel (u, v), as the lens draws it, of normalised image coordinates.
  Eigen::Vector2d toPixel(double x, double y) const {
    const Eigen::Vector2d s = distortion.distort({x, y});
    return {fx * s.x() + cx, fy * s.y() + cy};
  }

  /// Whether the lens distortion has an inverse at the pixel; it has in all of a valid image.
  bool canNormalise(double u, double v) const {
    return distortion.isNone() || distortion.isInvertibleAt({(u - cx) / fx, (v - cy) / fy});
  }

  /// Factor between a standard deviation in pixels and one in normalised coordinates [px].
  double focal_px() const { return std::sqrt(std::abs(fx * fy)); }

  /// The same at normalised coordinates (x, y), where the lens distortion stretches the image
  /// (geometric mean of the axes) [px].
  double focal_px(double x, double y) const {
    if (distortion.isNone()) return focal_px();
    return focal_px() * std::sqrt(std::abs(distortion.J_distorted_ideal({x, y}).determinant()));
  }

  /// Whether (u, v) lies at least `margin_px` within the image.
  bool contains(double u, double v, double margin_px = 0) const {
    return u >= margin_px - 0.5 && v >= margin_px - 0.5 && u <= width - 0.5 - margin_px &&
           v <= height - 0.5 - margin_px;
  }
};

}  // namespace depthservo
