#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "depthservo/api.h"

namespace depthservo {

/// How long something took, however often: counts by length, in the memory that it has at the
/// beginning.
///
/// Lengths from 1 us to 1000 s are told apart where they differ by 1 %; shorter and longer ones are
/// counted with the shortest and the longest. Real-time: nothing allocates, locks or throws.
class DEPTHSERVO_API DurationHistogram {
 public:
  void add(double duration_s) noexcept;  ///< NaN is left out

  std::size_t count() const noexcept { return count_; }

  /// The length that this share of all do not exceed, or up to 1 % more [s]; NaN of none. \param
  /// share 0..1
  double percentile(double share) const noexcept;

  static constexpr std::size_t kBins = 2100;
  std::uint64_t inBin(std::size_t bin) const noexcept { return counts_[bin]; }
  static double endOf(std::size_t bin) noexcept;  ///< the greatest length that it counts [s]

 private:
  std::array<std::uint64_t, kBins> counts_{};
  std::size_t count_ = 0;
  double longest_s_ = 0;
};

}  // namespace depthservo
