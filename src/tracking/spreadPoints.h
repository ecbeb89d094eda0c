#pragma once

#include <vector>

#include "depthservo/tracking/PointTracker.h"

namespace depthservo::detail {

/// At most so many of the points, spread over the image: each next one is the one farthest from
/// those taken, from the one nearest to their barycentre on (farthest-point sampling).
std::vector<TrackedPoint> spread(std::vector<TrackedPoint> points, std::size_t count);

}  // namespace depthservo::detail
