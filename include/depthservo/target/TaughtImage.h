#pragma once

#include <Eigen/Core>
#include <vector>

#include "depthservo/visp/GrayImage.h"

namespace depthservo {

/// An image that was shown, and the points in it that shall be found again in others; the index is
/// the id.
struct TaughtImage {
  GrayImage image;
  std::vector<Eigen::Vector2d> points;  ///< (u, v) [px]
};

}  // namespace depthservo
