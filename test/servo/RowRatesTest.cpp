// Rows of odometry that do not fall on images: depths must stay as good, and sigma honest.
// DEPTHSERVO_PAIRS=10: all 30 pairs of rates with so many seeds, as a table (3 minutes).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "motion/median.h"

namespace depthservo {
namespace {

struct Depths {
  double coverage = 0, error = 0;  // mean; median of the worst final errors
  int converged = 0;
};

Depths ofRuns(const std::string& rows, int camera, int odometry, int seeds) {
  Depths depths;
  std::vector<double> errors;
  for (int seed = 1; seed <= seeds; ++seed) {
    const RunLog log =
        run(Scenario::load(DEPTHSERVO_DATA "/scenarios/unicycle-4dots.yaml",
                           {"seed=" + std::to_string(seed), "camera.rate=" + std::to_string(camera),
                            "odometry.rate=" + std::to_string(odometry), "odometry.rows=" + rows}));
    const Metrics metrics = computeMetrics(log);
    depths.converged += log.outcome == Outcome::converged;
    depths.coverage += metrics.coverage_2sigma / seeds;
    errors.push_back(metrics.final_depth_error_max);
  }
  depths.error = detail::medianOf(errors);
  return depths;
}

struct Limits {
  const char* rows;
  double leastCoverage;
  double mostError;  // where that with rows on images is below half of it
};

class RowRates : public testing::TestWithParam<Limits> {};

TEST_P(RowRates, leaveDepthsAsGoodAsWithRowsOnImages) {
  const char* const asked = std::getenv("DEPTHSERVO_PAIRS");
  const int seeds = asked ? std::max(1, std::atoi(asked)) : 2;
  const std::vector<int> cameras = asked ? std::vector{20, 25, 30, 50, 60} : std::vector{30, 60};
  const std::vector<int> rates =
      asked ? std::vector{10, 29, 31, 50, 100, 200} : std::vector{10, 31, 100};
  const Limits& limits = GetParam();
  double coverage = 0;
  for (const int camera : cameras) {
    const Depths onImages = ofRuns("hold", camera, camera, seeds);
    for (const int odometry : rates) {
      const Depths depths = ofRuns(limits.rows, camera, odometry, seeds);
      coverage += depths.coverage / double(cameras.size() * rates.size());
      if (asked) {
        std::printf("%-11s camera %2d Hz, rows %3d Hz: coverage %.3f, error %.2f %% (%.1f times)\n",
                    limits.rows, camera, odometry, depths.coverage, 100 * depths.error,
                    depths.error / onImages.error);
      }
      EXPECT_EQ(depths.converged, seeds);
      EXPECT_GE(depths.coverage, limits.leastCoverage) << camera << ' ' << odometry;
      EXPECT_LE(depths.error, std::max(2 * onImages.error, limits.mostError))
          << camera << ' ' << odometry;
    }
  }
  if (asked) std::printf("%-11s mean coverage %.3f\n", limits.rows, coverage);
  EXPECT_GE(coverage, .90);
  EXPECT_LE(coverage, .995);
}

// A mean that an image cuts says less of its parts, a sample nothing of what happens until the
// next: the price is accuracy, not honesty.
INSTANTIATE_TEST_SUITE_P(All, RowRates,
                         testing::Values(Limits{"hold", .9, 0}, Limits{"mean-before", .9, .01},
                                         Limits{"instant", .8, .04}),
                         [](const auto& limits) {
                           std::string name = limits.param.rows;
                           name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
                           return name;
                         });

}  // namespace
}  // namespace depthservo
