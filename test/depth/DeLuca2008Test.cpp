// The numerical experiment of De Luca, Oriolo, Robuffo Giordano 2008, sec. 5.1, and the sampled
// observer's figures on it. The truth is integrated at 1 kHz or finer, independently of the flow.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::StillPoint;

constexpr double kPi = 3.14159265358979323846;
constexpr double kFocal_px = 128;

Twist twistAt(double t) {
  return {{0.1 * std::cos(2 * kPi * t), 0, 0.5 * std::cos(kPi * t)},
          {0.6 * std::cos(kPi * t / 2), 0, 1}};
}

struct Sample {
  double t, error;  // chi - estimated chi [1/m] after the correction at t [s]
};

std::vector<Sample> run(double chi, double guess_chi, double rate, double duration,
                        double gainScale = 1) {
  NonlinearDepthObserver::Options options;
  const double k = 20 * gainScale, k_3_px = 0.5 * gainScale * gainScale;
  options.gains = {k, k_3_px * kFocal_px * kFocal_px, 0, 0};
  NonlinearDepthObserver observer(options);
  StillPoint point = StillPoint::at(10 / kFocal_px, -10 / kFocal_px, 1 / chi);
  observer.reset(point.measured(), {1 / guess_chi});
  std::vector<Sample> samples;
  const double dt = 1 / rate;
  for (int i = 0; i < std::lround(duration * rate); ++i) {
    const double t = i * dt;
    point.move(twistAt, t, t + dt);
    observer.predict(Motion::fromTwist(twistAt(t + dt / 2), dt));
    observer.correct(point.measured());
    samples.push_back({t + dt, point.chi() - observer.estimate().chi});
  }
  return samples;
}

/// When the error falls below the limit for good [s]; infinite when it never does.
double settled(const std::vector<Sample>& samples, double limit) {
  double since = INFINITY;
  for (const Sample& s : samples) {
    if (std::abs(s.error) >= limit) {
      since = INFINITY;
    } else if (std::isinf(since)) {
      since = s.t;
    }
  }
  return since;
}

double errorAt(const std::vector<Sample>& samples, double t) {
  double error = NAN;
  for (const Sample& s : samples) {
    if (s.t <= t + 1e-9) error = s.error;
  }
  return error;
}

struct TableRow {
  double rate_Hz, settled_1e_2, settled_1e_3, at1s, at4s;
};

class DeLuca2008 : public ::testing::TestWithParam<TableRow> {};

TEST_P(DeLuca2008, convergesAtEveryFrameRateAsTheContinuousObserver) {
  const TableRow& expected = GetParam();
  const auto samples = run(2, 1, expected.rate_Hz, 4);
  EXPECT_NEAR(settled(samples, 1e-2), expected.settled_1e_2, 0.5 / expected.rate_Hz + 0.006);
  if (std::isinf(expected.settled_1e_3)) {
    EXPECT_TRUE(std::isinf(settled(samples, 1e-3)));
  } else {
    EXPECT_NEAR(settled(samples, 1e-3), expected.settled_1e_3, 0.05);
  }
  EXPECT_NEAR(errorAt(samples, 1), expected.at1s, 1e-3);
  EXPECT_NEAR(std::abs(errorAt(samples, 4)), std::abs(expected.at4s), 0.3 * expected.at4s);
}

INSTANTIATE_TEST_SUITE_P(FrameRates, DeLuca2008,
                         ::testing::Values(TableRow{30, 1.07, INFINITY, -.018, 2.3e-3},
                                           TableRow{60, 1.08, 2.62, -.020, 6e-4},
                                           TableRow{100, 1.09, 1.25, -.021, 2e-4},
                                           TableRow{1000, 1.09, 1.411, -.021, 2e-6}));

TEST(DeLuca2008Depth, isPracticallyExactAfterOneSecond) {
  // chi 2 <- 1 and its other reading, Z = 2 m with chi 1; the paper's "zero after 1 s" is 1..3 %.
  EXPECT_LT(std::abs(errorAt(run(2, 1, 1000, 1), 1)), 0.03 * 2);
  const auto other = run(0.5, 1, 1000, 2);
  EXPECT_NEAR(errorAt(other, 1), 0.0134, 4e-3);
  EXPECT_NEAR(settled(other, 1e-2), 1.05, 0.05);
}

TEST(DeLuca2008Depth, staysAccurateWhenTheGainsAreTenfold) {
  for (double scale : {0.5, 1.0, 1.5, 3.0, 10.0}) {
    EXPECT_LT(std::abs(errorAt(run(2, 1, 30, 4, scale), 4)), 0.006) << "gains x " << scale;
  }
}

}  // namespace
}  // namespace depthservo
