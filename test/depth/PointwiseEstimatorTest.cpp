#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::StillPoint;

constexpr double kSigma = 0.5 / 600;
constexpr double kDt = 1. / 30;

Twist twistAt(double t) { return {{.1 * std::cos(t), .05, .08}, {.05, -.1 * std::sin(t), .2}}; }

/// Twist rows at 100 Hz from the start on, each what holds in its middle.
MotionBuffer odometry(double start_s, double end_s) {
  MotionBuffer buffer(2048);
  for (int i = 0; start_s + i * 0.01 < end_s - 1e-9; ++i) {
    buffer.push(start_s + i * 0.01, twistAt(start_s + i * 0.01 + 0.005));
  }
  return buffer;
}

void expectSame(const DepthEstimate& a, const DepthEstimate& b) {
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.chi, b.chi);
  EXPECT_EQ(a.sigma_chi, b.sigma_chi);
  EXPECT_EQ(a.excitation, b.excitation);
  EXPECT_EQ(a.status, b.status);
}

TEST(PointwiseEstimator, ofOnePointIsTheBareEstimator) {
  const MotionBuffer buffer = odometry(0, 5);
  PointwiseEstimator points(NonlinearDepthObserver(), 3, {2});
  NonlinearDepthObserver bare;
  StillPoint point = StillPoint::at(.1, -.1, 1);
  for (int i = 0; i < 100; ++i) {
    const double t = i * kDt;
    if (i > 0) point.move(twistAt, t - kDt, t);
    ASSERT_EQ(points.advance(buffer, t), Coverage::complete);
    if (i > 0) bare.predict(buffer.motion((i - 1) * kDt, t).motion);
    const bool isHidden = i > 40 && i < 50;
    if (!isHidden) {
      points.correct({{7, point.measured(kSigma)}});
      i == 0 ? bare.reset(point.measured(kSigma), {2}) : bare.correct(point.measured(kSigma));
    } else {
      points.correct({});
    }
    expectSame(points.estimate(7), bare.estimate());
  }
  EXPECT_NEAR(points.estimate(7).Z(), point.Z(), 0.01 * point.Z());
}

TEST(PointwiseEstimator, aRetiredPointLeavesItsPlaceToAnotherAndTheRestAlone) {
  const MotionBuffer buffer = odometry(0, 5);
  PointwiseEstimator all(NonlinearDepthObserver(), 3), two(NonlinearDepthObserver(), 2);
  StillPoint first = StillPoint::at(.1, -.1, 1), second = StillPoint::at(-.1, .2, 2),
             third = StillPoint::at(.2, .1, 1.5);
  for (int i = 0; i < 60; ++i) {
    const double t = i * kDt;
    for (StillPoint* point : {&first, &second, &third}) {
      if (i > 0) point->move(twistAt, t - kDt, t);
    }
    all.advance(buffer, t);
    two.advance(buffer, t);
    if (i == 20) {
      EXPECT_TRUE(two.retire(1));
    }
    std::vector<PointObservation> early = {{1, first.measured(kSigma)},
                                           {2, second.measured(kSigma)}};
    std::vector<PointObservation> late = {{2, second.measured(kSigma)},
                                          {3, third.measured(kSigma)}};
    all.correct(i < 20 ? early : late);
    two.correct(i < 20 ? early : late);
  }
  expectSame(two.estimate(2), all.estimate(2));
  expectSame(two.estimate(3), all.estimate(3));
  EXPECT_EQ(two.estimate(1).status, DepthStatus::unset);
  EXPECT_EQ(two.ignored(), 0u);
  EXPECT_FALSE(two.retire(1));
}

TEST(PointwiseEstimator, knowsPointsByAnyIdAndKeepsThemApart) {
  const MotionBuffer buffer = odometry(0, 5);
  PointwiseEstimator points(NonlinearDepthObserver(), 3);
  std::vector<StillPoint> truth{StillPoint::at(.1, -.1, 1), StillPoint::at(-.1, .1, 2),
                                StillPoint::at(.2, .1, 0.7)};
  const int ids[] = {-5, 1000000, 0};
  for (int i = 0; i < 100; ++i) {
    const double t = i * kDt;
    std::vector<PointObservation> seen;
    for (std::size_t j = 0; j < 3; ++j) {
      if (i > 0) truth[j].move(twistAt, t - kDt, t);
    }
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t k = (j + static_cast<std::size_t>(i)) % 3;  // in changing order
      seen.push_back({ids[k], truth[k].measured(kSigma)});
    }
    points.advance(buffer, t);
    points.correct(seen);
  }
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(points.estimate(ids[j]).Z(), truth[j].Z(), 0.02 * truth[j].Z()) << ids[j];
  }
}

TEST(PointwiseEstimator, ignoresAndCountsPointsBeyondItsCapacity) {
  PointwiseEstimator points(NonlinearDepthObserver(), 2);
  const MotionBuffer buffer = odometry(0, 1);
  points.advance(buffer, 0);
  points.correct({{1, {.1, 0, kSigma}}, {2, {.2, 0, kSigma}}, {3, {.3, 0, kSigma}}});
  EXPECT_EQ(points.ignored(), 1u);
  EXPECT_EQ(points.estimate(2).x, .2);
  EXPECT_EQ(points.estimate(3).status, DepthStatus::unset);
  EXPECT_FALSE(points.setPrior(3, {2}));
  EXPECT_TRUE(points.setPrior(2, {2}));
}

TEST(PointwiseEstimator, missingIdCoastsAndTheOthersDoNot) {
  PointwiseEstimator points(NonlinearDepthObserver(), 2);
  const MotionBuffer buffer = odometry(0, 1);
  points.advance(buffer, 0);
  points.correct({{1, {.1, 0, kSigma}}, {2, {.2, 0, kSigma}}});
  points.advance(buffer, .1);
  points.correct({{1, {.1, 0, kSigma}}});
  EXPECT_NE(points.estimate(1).status, DepthStatus::coasting);
  EXPECT_EQ(points.estimate(2).status, DepthStatus::coasting);
}

TEST(PointwiseEstimator, usesThePriorOfEachPoint) {
  PointwiseEstimator points(NonlinearDepthObserver(), 3, {3});
  points.setPrior(2, {0.5, 0.1});
  const MotionBuffer buffer = odometry(0, 1);
  EXPECT_NEAR(points.estimate(1).Z(), 3, 1e-12) << "the default prior before any measurement";
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
  points.advance(buffer, 0);
  points.correct({{1, {.1, 0, kSigma}}, {2, {.2, 0, kSigma}}});
  EXPECT_NEAR(points.estimate(1).Z(), 3, 1e-12);
  EXPECT_NEAR(points.estimate(2).Z(), 0.5, 1e-12);
  EXPECT_NEAR(points.estimate(2).sigma_chi, 0.1, 1e-12);
}

TEST(PointwiseEstimator, newPriorStartsAKnownPointAnew) {
  PointwiseEstimator points(NonlinearDepthObserver(), 1);
  const MotionBuffer buffer = odometry(0, 1);
  points.advance(buffer, 0);
  points.correct({{1, {.1, 0, kSigma}}});
  points.setPrior(1, {4});
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset) << "until it is measured";
  points.advance(buffer, .1);
  points.correct({{1, {.12, 0, kSigma}}});
  EXPECT_NEAR(points.estimate(1).Z(), 4, 1e-12);
  EXPECT_EQ(points.estimate(1).x, .12);
}

TEST(PointwiseEstimator, lateOdometryLeavesEverythingUntilItHasArrived) {
  PointwiseEstimator points(NonlinearDepthObserver(), 1), undisturbed(NonlinearDepthObserver(), 1);
  const MotionBuffer early = odometry(0, .5), all = odometry(0, 2);
  for (auto* p : {&points, &undisturbed}) {
    p->advance(all, 0);
    p->correct({{1, {.1, 0, kSigma}}});
  }
  const DepthEstimate before = points.estimate(1);
  EXPECT_EQ(points.advance(early, .52), Coverage::afterEnd);
  EXPECT_EQ(points.time(), 0);
  expectSame(points.estimate(1), before);
  EXPECT_EQ(points.advance(all, -1), Coverage::reversed);
  EXPECT_EQ(points.advance(all, std::nan("")), Coverage::reversed);
  EXPECT_EQ(points.time(), 0);
  expectSame(points.estimate(1), before);
  EXPECT_EQ(points.advance(all, 1), Coverage::complete);
  undisturbed.advance(all, 1);
  expectSame(points.estimate(1), undisturbed.estimate(1));
}

TEST(PointwiseEstimator, odometryThatStartsLaterStartsThePointsAnewWithTheirDepth) {
  for (const bool isEmpty : {true, false}) {
    PointwiseEstimator points(NonlinearDepthObserver(), 1, {2.5});
    const MotionBuffer late = isEmpty ? MotionBuffer() : odometry(1, 3);
    points.advance(late, 0);
    points.correct({{1, {.1, 0, kSigma}}});
    EXPECT_EQ(points.advance(late, 0.5), isEmpty ? Coverage::empty : Coverage::beforeStart);
    EXPECT_EQ(points.time(), 0.5);
    EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
    EXPECT_NEAR(points.estimate(1).Z(), 2.5, 1e-12) << "kept as a guess";
    points.correct({{1, {.3, 0, kSigma}}});
    EXPECT_EQ(points.estimate(1).x, .3) << "started, not rejected";
    EXPECT_NEAR(points.estimate(1).Z(), 2.5, 1e-12);
  }
}

TEST(PointwiseEstimator, timeThatIsNotFiniteDoesNotStart) {
  PointwiseEstimator points(NonlinearDepthObserver(), 1);
  EXPECT_TRUE(std::isnan(points.time()));
  EXPECT_EQ(points.advance(odometry(0, 1), std::nan("")), Coverage::reversed);
  EXPECT_EQ(points.advance(odometry(0, 1), INFINITY), Coverage::reversed);
  EXPECT_TRUE(std::isnan(points.time()));
  EXPECT_EQ(points.advance(odometry(0, 1), 0.5), Coverage::complete);
}

TEST(PointwiseEstimator, unusableFirstMeasurementDoesNotStartAPoint) {
  PointwiseEstimator points(NonlinearDepthObserver(), 1);
  points.advance(odometry(0, 1), 0);
  points.correct({{1, {std::nan(""), 0, kSigma}}});
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
  points.correct({{1, {.1, 0, kSigma}}});
  EXPECT_EQ(points.estimate(1).x, .1);
}

TEST(PointwiseEstimator, estimateIsPredictedToNow) {
  PointwiseEstimator points(NonlinearDepthObserver(), 1, {1, 1e-3});
  const MotionBuffer buffer = odometry(0, 2);
  StillPoint point = StillPoint::at(.1, -.1, 1);
  points.advance(buffer, 0.2);
  points.correct({{1, point.measured(kSigma)}});
  point.move(twistAt, 0.2, 1.0);
  const DepthEstimate now = points.estimate(1, buffer, 1.0);
  EXPECT_NEAR(now.x, point.x(), 1e-5);  // twist rows are constant over 10 ms
  EXPECT_NEAR(now.y, point.y(), 1e-5);
  EXPECT_NEAR(now.Z(), point.Z(), 1e-5);
  EXPECT_EQ(points.time(), 0.2) << "the estimator itself has not moved";
  expectSame(points.estimate(1, buffer, 2.02), points.estimate(1));  // the odometry is only late
  const DepthEstimate longAfter = points.estimate(1, buffer, 99);
  EXPECT_EQ(longAfter.status, DepthStatus::coasting);
  EXPECT_EQ(longAfter.sigma_chi, DepthPrior::kWideSigma_chi) << "it may be anywhere by then";
  EXPECT_EQ(points.estimate(2, buffer, 1.0).status, DepthStatus::unset);
}

TEST(PointwiseEstimator, fusesADepthOfAKnownPointOnly) {
  PointwiseEstimator points(NonlinearDepthObserver(), 2);
  points.correctDepth(1, {2, .01});
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
  points.advance(odometry(0, 1), 0);
  points.correct({{1, {.1, 0, kSigma}}});
  points.correctDepth(1, {2, 1e-3});
  EXPECT_NEAR(points.estimate(1).Z(), 2, 1e-4);
}

TEST(PointwiseEstimator, cloneIsIndependentAndResetForgets) {
  PointwiseEstimator points(NonlinearDepthObserver(), 2, {3});
  const MotionBuffer buffer = odometry(0, 1);
  points.advance(buffer, 0);
  points.correct({{1, {.1, 0, kSigma}}});
  const auto clone = points.clone();
  clone->advance(buffer, .5);
  clone->correct({{1, {.2, 0, kSigma}}, {2, {.2, 0, kSigma}}});
  EXPECT_EQ(points.time(), 0);
  EXPECT_EQ(points.estimate(1).x, .1);
  EXPECT_EQ(points.estimate(2).status, DepthStatus::unset);
  points.reset();
  EXPECT_TRUE(std::isnan(points.time()));
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
  EXPECT_EQ(clone->estimate(2).x, .2);
}

}  // namespace
}  // namespace depthservo
