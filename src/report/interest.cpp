#include "report/interest.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Error in sigmas of a depth that is claimed; 0 where none is, or the truth is not known.
double surprise(const PointMetrics& point) {
  const bool claimsDepth =
      point.status == DepthStatus::valid || point.status == DepthStatus::converging;
  const double errors = point.relative_error * point.Z_true / point.sigma_Z;
  return claimsDepth && std::isfinite(errors) ? errors : 0;
}

}  // namespace

std::vector<int> mostTelling(const std::vector<PointMetrics>& points, std::size_t most) {
  std::vector<int> chosen;
  if (points.size() <= most) {
    for (const PointMetrics& point : points) chosen.push_back(point.id);
    return chosen;
  }
  std::vector<PointMetrics> longest = points;
  std::stable_sort(longest.begin(), longest.end(), [](const auto& a, const auto& b) {
    return a.measured_frames > b.measured_frames;
  });
  std::vector<PointMetrics> worst = longest;
  std::stable_sort(worst.begin(), worst.end(),
                   [](const auto& a, const auto& b) { return surprise(a) > surprise(b); });
  for (std::size_t i = 0; chosen.size() < most; ++i) {
    for (const PointMetrics* next : {&longest[i], &worst[i]}) {
      const bool isNew = std::find(chosen.begin(), chosen.end(), next->id) == chosen.end();
      if (isNew && chosen.size() < most) chosen.push_back(next->id);
    }
  }
  return chosen;
}

}  // namespace depthservo
