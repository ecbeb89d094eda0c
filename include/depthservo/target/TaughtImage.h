#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Core>
#include <vector>

#include "depthservo/visp/visp.h"

namespace depthservo {

/// An image that was shown, and the points in it that shall be found again in others; the index is
/// the id.
struct TaughtImage {
  DEPTHSERVO_VISP vpImage<unsigned char> image;
  std::vector<Eigen::Vector2d> points;  ///< (u, v) [px]
};

}  // namespace depthservo
