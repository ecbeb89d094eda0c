#include "depthservo/rig/DurationHistogram.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace depthservo {
namespace {

constexpr double kFirstEnd_s = 1e-6, kRatio = 1.01;

}  // namespace

double DurationHistogram::endOf(std::size_t bin) noexcept {
  return kFirstEnd_s * std::pow(kRatio, static_cast<double>(bin));
}

void DurationHistogram::add(double duration_s) noexcept {
  if (std::isnan(duration_s)) return;
  const double ratio = std::max(duration_s, kFirstEnd_s) / kFirstEnd_s;
  const double bin = std::ceil(std::log(ratio) / std::log(kRatio));
  ++counts_[static_cast<std::size_t>(std::clamp(bin, 0., kBins - 1.))];
  ++count_;
  longest_s_ = std::max(longest_s_, duration_s);
}

double DurationHistogram::percentile(double share) const noexcept {
  if (count_ == 0) return std::numeric_limits<double>::quiet_NaN();
  const double rank = std::max(1., std::ceil(share * static_cast<double>(count_)));
  std::uint64_t sum = 0;
  std::size_t bin = 0;
  while (bin + 1 < kBins && static_cast<double>(sum += counts_[bin]) < rank) ++bin;
  return bin + 1 == kBins ? longest_s_ : std::min(endOf(bin), longest_s_);
}

}  // namespace depthservo
