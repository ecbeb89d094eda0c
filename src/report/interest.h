#pragma once

#include <vector>

#include "depthservo/report/Metrics.h"

namespace depthservo {

/// The points that tell most, as many as can be shown: all where they are few enough, by id; else
/// in turn the one measured longest and the one whose error is largest for its sigma (without
/// truth: that is measured longest).
std::vector<int> mostTelling(const std::vector<PointMetrics>& points, std::size_t most);

}  // namespace depthservo
