#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Core>
#include <array>
#include <optional>

#include "depthservo/visp/visp.h"

namespace depthservo::detail {

/// The corners of a quadrilateral in the image.
struct TagCorners {
  std::array<Eigen::Vector2d, 4> corners;  // [px]
  std::array<double, 4> sigma_px;          // per axis
};

/// Refines the corners of a dark (or light) quadrilateral by lines through the edges of its four
/// sides.
///
/// \param rough in order round the quadrilateral, good to about a pixel
/// \param cells how many cells of the tag fit along a side: the flat ground on either side of an
/// edge reaches one cell far \return empty when a side has too little contrast, or fewer than four
/// usable points
std::optional<TagCorners> refineTagCorners(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                           const std::array<Eigen::Vector2d, 4>& rough, int cells);

}  // namespace depthservo::detail
