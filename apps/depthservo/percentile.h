#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace depthservo {

/// The value that this share of all do not exceed; NaN of none.
inline double percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  const auto place =
      values.begin() + std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(rank) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace depthservo
