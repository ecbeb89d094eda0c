#include "sequence/associate.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace depthservo::detail {

std::vector<std::optional<std::size_t>> associate(const std::vector<double>& first,
                                                  const std::vector<double>& second,
                                                  double most_s) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  auto from = second.begin();
  for (std::size_t i = 0; i < first.size(); ++i) {
    while (from != second.end() && *from <= first[i] - most_s) ++from;
    for (auto it = from; it != second.end() && *it < first[i] + most_s; ++it) {
      pairs.emplace_back(std::abs(first[i] - *it), i, it - second.begin());
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::optional<std::size_t>> partners(first.size());
  std::vector<bool> isTaken(second.size(), false);
  for (const auto& [difference, i, j] : pairs) {
    if (!(difference < most_s) || partners[i] || isTaken[j]) continue;
    partners[i] = j;
    isTaken[j] = true;
  }
  return partners;
}

}  // namespace depthservo::detail
