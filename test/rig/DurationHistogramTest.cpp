#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include "depthservo/rig/DurationHistogram.h"

namespace depthservo {
namespace {

// Whatever is added: there is nothing in it that could grow.
static_assert(std::is_trivially_copyable_v<DurationHistogram>);

TEST(DurationHistogram, percentiles_of_a_day_of_images_are_right_within_one_percent) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> latency(std::log(8e-3), 1.2);
  DurationHistogram histogram;
  std::vector<double> all(300000);
  for (double& each : all) histogram.add(each = latency(random));
  std::sort(all.begin(), all.end());
  EXPECT_EQ(histogram.count(), all.size());
  for (const double share : {0., 0.001, 0.5, 0.9, 0.999, 1.}) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(all.size())));
    const double exact = all[std::max<std::size_t>(rank, 1) - 1];
    EXPECT_GE(histogram.percentile(share), exact * (1 - 1e-12)) << share;
    EXPECT_LE(histogram.percentile(share), exact * 1.01 * (1 + 1e-12)) << share;
  }
}

TEST(DurationHistogram, nothing_is_unknown_and_extremes_stay_finite) {
  DurationHistogram histogram;
  EXPECT_TRUE(std::isnan(histogram.percentile(0.5)));
  histogram.add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(histogram.count(), 0u);
  histogram.add(-1);  // a stamp ahead of the clock
  histogram.add(1e9);
  EXPECT_LE(histogram.percentile(0.5), 1e-6);
  EXPECT_EQ(histogram.percentile(1), 1e9);
}

TEST(DurationHistogram, bins_of_several_runs_can_be_added) {
  DurationHistogram histogram;
  for (const double each : {1e-3, 1e-3, 0.5}) histogram.add(each);
  std::size_t sum = 0;
  for (std::size_t bin = 0; bin < DurationHistogram::kBins; ++bin) {
    if (histogram.inBin(bin) == 2) {
      EXPECT_GE(DurationHistogram::endOf(bin), 1e-3);
      EXPECT_LT(DurationHistogram::endOf(bin), 1.011e-3);
    }
    sum += histogram.inBin(bin);
  }
  EXPECT_EQ(sum, 3u);
}

}  // namespace
}  // namespace depthservo
