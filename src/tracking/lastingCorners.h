#pragma once

#include <visp3/core/vpImage.h>

#include <vector>

#include "depthservo/api.h"
#include "depthservo/tracking/PointTracker.h"
#include "depthservo/visp/visp.h"

namespace depthservo::detail {

/// At most so many natural corners, ids 0, 1, ..., spread over the image. They are chosen in an
/// image of half the size: such corners are still there when they are seen from twice as far.
DEPTHSERVO_INNER std::vector<TrackedPoint> lastingCorners(
    const DEPTHSERVO_VISP vpImage<unsigned char>& image, std::size_t count);

/// At most so many of the points, spread over the image: each next one is the one farthest from
/// those taken, from the one nearest to their barycentre on (farthest-point sampling).
std::vector<TrackedPoint> spread(std::vector<TrackedPoint> points, std::size_t count);

}  // namespace depthservo::detail
