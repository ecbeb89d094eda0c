// Time passes with the camera's motion unknown: whatever the method, no depth is called valid that
// may be wrong by more than its sigma says, and it is learnt again afterwards.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "depthservo/pose/VisualMotionObserver.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::Random;
using test::StillPoint;

constexpr double kPeriod_s = 1. / 25, kRow_s = 1. / 75, kSigma = .3 / 600;
constexpr double kFrom_s = 4, kTo_s = 5.2, kEnd_s = 12;  // the motion is unknown from, to
const std::vector<Eigen::Vector3d> kTarget{
    {-.15, -.15, 0}, {.15, -.15, 0}, {.15, .15, 0}, {-.15, .15, 0}};  // m
constexpr double kDistance_m = 2.4;

struct Method {
  std::string name;
  std::function<std::unique_ptr<PointSetEstimator>()> make;
  bool learns = true;
  double modelError = 0;  // of a depth, as a share of it: what sigma does not know of
};

template <class Estimator>
std::unique_ptr<PointSetEstimator> pointwise(const Estimator& estimator, const DepthPrior& prior) {
  return std::make_unique<PointwiseEstimator>(estimator, kTarget.size(), prior);
}

const std::vector<Method> kMethods{
    {"InverseDepthFilter", [] { return pointwise(InverseDepthFilter(), {1}); }},
    {"SharedErrorFilter",
     [] {
       return std::make_unique<SharedErrorFilter>(kTarget.size(), SharedErrorFilterOptions{});
     }},
    {"JointDepthFilter",
     [] { return std::make_unique<JointDepthFilter>(kTarget.size(), JointDepthFilterOptions{}); }},
    {"WindowDepthEstimator",
     [] {
       WindowOptions options;
       options.spacing_s = .1;
       return pointwise(WindowDepthEstimator(options), {1});
     }},
    {"NonlinearDepthObserver", [] { return pointwise(NonlinearDepthObserver(), {2}); }},
    {"ObjectDepthObserver",
     [] {
       return std::make_unique<ObjectDepthObserver>(kTarget.size(), NonlinearObserverOptions{},
                                                    DepthPrior{2});
     },
     true, .02},  // one depth for a plate that is seen at a slant
    {"VisualMotionObserver", [] { return std::make_unique<VisualMotionObserver>(kTarget); }},
    {"ConstantDepth",
     [] {
       return pointwise(ConstantDepth(), {kDistance_m, .005});
     },
     false}};

/// Across the line of sight at up to 0.3 m/s, and a little of all else.
Twist usual(double t) {
  return {{.25 * std::cos(1.9 * t), .15 * std::sin(1.3 * t), .05 * std::cos(.7 * t)},
          {.03 * std::sin(t), .04 * std::cos(t), .1 * std::sin(.5 * t)}};
}

/// What the camera does while nobody knows.
struct Meanwhile {
  std::string name;
  std::function<Twist(double)> twist;
};
const std::vector<Meanwhile> kMeanwhile{
    {"goesOn", usual},
    {"stops", [](double) { return Twist{}; }},
    {"advances",
     [](double t) {
       return Twist{{0, 0, std::min(.3 + 2 * (t - kFrom_s), 1.)}, {0, 0, .2}};
     }},
    {"retreats", [](double t) {
       return Twist{{.1, 0, std::max(-.3 - 2 * (t - kFrom_s), -1.)}, {.1, .1, 0}};
     }}};

/// How the odometry is lost.
enum class Loss { rowsMissing, rowsNotFinite, rowsEnd };

class UnknownMotionTest
    : public ::testing::TestWithParam<std::tuple<std::size_t, std::size_t, Loss>> {};

TEST_P(UnknownMotionTest, noDepthIsConfidentAndWrongAndAllAreLearntAgain) {
  const auto& [method, meanwhile, loss] = GetParam();
  const bool comesBack = loss != Loss::rowsEnd;
  const bool isPose = kMethods[method].name == "VisualMotionObserver";
  const bool learns = kMethods[method].learns;
  const auto estimator = kMethods[method].make();
  const auto twistAt = [&, &unknown = kMeanwhile[meanwhile].twist](double t) {
    return t >= kFrom_s && t < kTo_s ? unknown(t) : usual(t);
  };
  std::vector<StillPoint> points;
  for (const auto& p : kTarget) points.emplace_back(p + Eigen::Vector3d(0, 0, kDistance_m));
  Random random(7);
  MotionBuffer odometry;
  double rows_s = 0, sigmaBefore = 0;
  std::vector<PointObservation> seen;
  for (int k = 0; k * kPeriod_s < (comesBack ? kEnd_s : kTo_s); ++k) {
    const double t = k * kPeriod_s;
    for (; rows_s < t + 1e-9; rows_s += kRow_s) {
      const bool isLost = rows_s > kFrom_s - 1e-9 && rows_s < (comesBack ? kTo_s : 1e9) - 1e-9;
      if (!isLost) odometry.push(rows_s, twistAt(rows_s + kRow_s / 2));
      if (isLost && loss == Loss::rowsNotFinite) {
        odometry.push(rows_s, {{std::nan(""), 0, 0}, {0, 0, 0}});
      }
    }
    const Coverage coverage = estimator->advance(odometry, t);
    if (!hasMotion(coverage)) {  // in the first moments it may only be late
      ASSERT_EQ(coverage, Coverage::afterEnd);
      ASSERT_TRUE(t > kFrom_s && t < kFrom_s + .06 + kPeriod_s) << t;
    }
    if (k > 0) {
      for (StillPoint& p : points) p.move(twistAt, t - kPeriod_s, t);
    }
    if (!hasMotion(coverage)) continue;
    seen.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      PointMeasurement m = points[i].measured(kSigma);
      m.x += random.normal(kSigma);
      m.y += random.normal(kSigma);
      seen.push_back({static_cast<int>(i), m});
    }
    estimator->correct(seen);

    for (std::size_t i = 0; i < points.size(); ++i) {
      const DepthEstimate e = estimator->estimate(static_cast<int>(i));
      const double known = kMethods[method].modelError * e.chi;
      const double off = (std::abs(e.chi - points[i].chi()) - known) / e.sigma_chi;
      SCOPED_TRACE(testing::Message()
                   << t << " s, point " << i << ": Z " << e.Z() << " +- " << e.sigma_Z() << " "
                   << e.status << ", true " << points[i].Z());
      const bool isUnknown = coverage != Coverage::complete;
      if (isUnknown && !isPose) {
        ASSERT_EQ(e.status, DepthStatus::coasting);
      }
      if (isUnknown) {
        ASSERT_NEAR(e.x, seen[i].measurement.x, kSigma / 10) << "the image says where it is";
      }
      if (learns && t > 2) {
        ASSERT_LT(off, 6);
      }
      if (!learns && isUnknown) {
        ASSERT_LT(off, 6);
      }
      if (coverage == Coverage::ended && !isPose && i == 0) {
        ASSERT_GE(e.sigma_chi, sigmaBefore);
        sigmaBefore = e.sigma_chi;
      }
      if (learns && t > kEnd_s - 1) {
        EXPECT_EQ(e.status == DepthStatus::valid || e.status == DepthStatus::unexcited, true);
        EXPECT_NEAR(e.Z() / points[i].Z(), 1, .05);
      }
    }
  }
}

std::string nameOf(const ::testing::TestParamInfo<UnknownMotionTest::ParamType>& test) {
  const char* const losses[] = {"rowsMissing", "rowsNotFinite", "rowsEnd"};
  return kMethods[std::get<0>(test.param)].name + "_" + kMeanwhile[std::get<1>(test.param)].name +
         "_" + losses[static_cast<int>(std::get<2>(test.param))];
}

INSTANTIATE_TEST_SUITE_P(All, UnknownMotionTest,
                         ::testing::Combine(::testing::Range<std::size_t>(0, kMethods.size()),
                                            ::testing::Range<std::size_t>(0, kMeanwhile.size()),
                                            ::testing::Values(Loss::rowsMissing,
                                                              Loss::rowsNotFinite, Loss::rowsEnd)),
                         nameOf);

TEST(UnknownMotionOfHiddenPoints, theyStayInPlaceWithAGrowingSigmaAndAreNotRejectedAfterwards) {
  for (const Method& method : kMethods) {
    SCOPED_TRACE(method.name);
    const auto estimator = method.make();
    std::vector<StillPoint> points;
    for (const auto& p : kTarget) points.emplace_back(p + Eigen::Vector3d(0, 0, kDistance_m));
    MotionBuffer odometry;
    const auto measure = [&] {
      std::vector<PointObservation> seen;
      for (int i = 0; i < 4; ++i) seen.push_back({i, points[i].measured(kSigma)});
      estimator->correct(seen);
    };
    double t = 0;
    for (; t < 3; t += kPeriod_s) {
      for (int j = 0; j < 3; ++j) odometry.push(t + j * kRow_s, usual(t));
      estimator->advance(odometry, t);
      if (t > 0) {
        for (StillPoint& p : points) p.move(usual(t - kPeriod_s), kPeriod_s);
      }
      measure();
    }
    const DepthEstimate before = estimator->estimate(0);
    double sigma_xy = 0;
    for (const double until = t + .2; t < until; t += kPeriod_s) {
      // The rows at hand still tell of the first period.
      const Twist twist = t < 3.02 ? usual(t - kPeriod_s) : Twist{{.6, 0, 0}, {0, 0, 0}};
      for (StillPoint& p : points) p.move(twist, kPeriod_s);
      if (!hasMotion(estimator->advance(odometry, t))) continue;
      estimator->correct({});
      const DepthEstimate e = estimator->estimate(0);
      ASSERT_TRUE(e.status == DepthStatus::coasting || e.status == DepthStatus::lost) << e.status;
      ASSERT_GT(e.sigma_xy, sigma_xy);
      ASSERT_LT(std::hypot(e.x - points[0].x(), e.y - points[0].y()), 6 * e.sigma_xy);
      sigma_xy = e.sigma_xy;
    }
    estimator->advance(odometry, t);
    measure();
    EXPECT_GT(sigma_xy, 10 * before.sigma_xy);
    EXPECT_NEAR(estimator->estimate(0).x, points[0].x(), kSigma / 10);
    EXPECT_NE(estimator->estimate(0).status, DepthStatus::rejected);
  }
}

}  // namespace
}  // namespace depthservo
