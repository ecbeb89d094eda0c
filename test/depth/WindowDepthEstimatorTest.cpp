#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::Random;
using test::StillPoint;

constexpr double kDt = 0.1;
constexpr double kSigma = 1.0 / 600;
const Twist kSideways{{.1, .03, 0}, {0, 0, 0}};

WindowOptions options(WindowMethod method, std::size_t images = 20) {
  WindowOptions result;
  result.method = method;
  result.images = images;
  return result;
}

/// A point and its estimator, moved together.
struct ObservedPoint {
  explicit ObservedPoint(const StillPoint& still, const WindowOptions& chosen = {},
                         double measurementSigma = kSigma, const DepthPrior& prior = {})
      : point(still), estimator(chosen), sigma(measurementSigma) {
    estimator.reset(measured(), prior);
  }

  PointMeasurement measured() {
    PointMeasurement m = point.measured(sigma);
    if (noise) {
      m.x += noise->normal(sigma);
      m.y += noise->normal(sigma);
    }
    return m;
  }
  void hide(const Twist& twist, int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      point.move(twist, kDt);
      estimator.predict(Motion::fromTwist(twist, kDt));
    }
  }
  void see(const Twist& twist, int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      hide(twist);
      estimator.correct(measured());
    }
  }
  DepthEstimate estimate() const { return estimator.estimate(); }
  DepthStatus status() const { return estimate().status; }
  double error() const { return estimate().Z() - point.Z(); }

  StillPoint point;
  WindowDepthEstimator estimator;
  double sigma;
  Random* noise = nullptr;
};

class EveryWindowMethod : public ::testing::TestWithParam<WindowMethod> {};
INSTANTIATE_TEST_SUITE_P(Methods, EveryWindowMethod,
                         ::testing::Values(WindowMethod::leastSquares,
                                           WindowMethod::maximumLikelihood, WindowMethod::robust));

TEST_P(EveryWindowMethod, perfectDataAreExactFromTheFirstMotionOnWhateverTheGuess) {
  const Twist twist{{.5, .1, .3}, {.1, -.2, .1}};
  for (double guess : {0.05, 1.0, 50.0}) {
    ObservedPoint run(StillPoint::at(.1, -.05, 3), options(GetParam()), 0, {guess});
    for (int i = 0; i < 30; ++i) {
      run.see(twist);
      ASSERT_NEAR(run.error(), 0, 1e-12) << "image " << i + 1;
      ASSERT_EQ(run.status(), DepthStatus::valid);
    }
  }
}

TEST_P(EveryWindowMethod, windowShorterThanAskedIsUsed) {
  ObservedPoint run(StillPoint::at(.1, -.05, 1), options(GetParam(), 500));
  run.see(kSideways, 12);
  EXPECT_EQ(run.estimator.size(), 12u);
  EXPECT_NEAR(run.error(), 0, 1e-6);
  EXPECT_EQ(run.status(), DepthStatus::valid);
}

TEST_P(EveryWindowMethod, windowNeverGrowsBeyondItsCapacity) {
  ObservedPoint run(StillPoint::at(.1, -.05, 1), options(GetParam(), 5));
  run.see(kSideways, 12);
  EXPECT_EQ(run.estimator.size(), 5u);
}

TEST_P(EveryWindowMethod, identicalPosesTeachNothingAndKeepTheBaseline) {
  ObservedPoint run(StillPoint::at(.1, -.05, 1), options(GetParam()));
  run.see({}, 5);
  EXPECT_EQ(run.status(), DepthStatus::unexcited);
  EXPECT_EQ(run.estimate().Z(), 1);
  run.see(kSideways, 20);
  const double sigma = run.estimate().sigma_chi;
  run.see({}, 100);
  EXPECT_EQ(run.estimator.size(), 20u);
  EXPECT_NEAR(run.error(), 0, 1e-9);
  EXPECT_NEAR(run.estimate().sigma_chi, sigma, 0.1 * sigma);
  EXPECT_EQ(run.status(), DepthStatus::valid);
}

TEST_P(EveryWindowMethod, pureRotationIsUnexcitedAndKeepsTheDepth) {
  const Twist turn{{0, 0, 0}, {.05, .1, .2}};
  ObservedPoint fresh(StillPoint::at(.1, -.05, 2), options(GetParam()));
  fresh.see(turn, 10);
  EXPECT_EQ(fresh.status(), DepthStatus::unexcited);
  EXPECT_EQ(fresh.estimator.fit().degeneracy, WindowDegeneracy::noBaseline);
  ObservedPoint learnt(StillPoint::at(.1, -.05, 2), options(GetParam()));
  learnt.see(kSideways, 20);
  learnt.see(turn, 30);
  EXPECT_NEAR(learnt.error(), 0, 1e-6);
}

TEST_P(EveryWindowMethod, motionTowardsThePointIsUnexcited) {
  ObservedPoint run(StillPoint::at(0, 0, 3), options(GetParam()), kSigma, {2});
  run.see({{0, 0, .1}, {0, 0, 0}}, 20);
  EXPECT_EQ(run.status(), DepthStatus::unexcited);
  EXPECT_EQ(run.estimator.fit().degeneracy, WindowDegeneracy::noBaseline);
  EXPECT_EQ(run.estimate().excitation, 0);
}

TEST_P(EveryWindowMethod, sigmaOfWhatIsSeenButNotKnownDoesNotGrowBeyondAll) {
  // A guess before the point: propagated, it nears the camera ever faster.
  ObservedPoint run(StillPoint::at(0, 0, 8), options(GetParam()), kSigma, {1});
  for (int i = 0; i < 100; ++i) {
    run.see({{0, 0, 0.6}, {0, 0, 0}});
    ASSERT_LE(run.estimate().sigma_chi, 1.01 * DepthPrior::kWideSigma_chi) << "image " << i + 1;
  }
}

TEST_P(EveryWindowMethod, vagueFitIsNotTaken) {
  ObservedPoint run(StillPoint::at(.1, 0, 5), options(GetParam()), kSigma, {2});
  run.see({{.01, 0, 0}, {0, 0, 0}}, 3);
  EXPECT_EQ(run.status(), DepthStatus::converging);
  EXPECT_EQ(run.estimate().Z(), 2) << "the prior, not 1/chi";
  EXPECT_EQ(run.estimate().sigma_chi, DepthPrior::kWideSigma_chi);
}

TEST_P(EveryWindowMethod, fitBeyondInfinityIsNotTaken) {
  WindowDepthEstimator estimator(options(GetParam()));
  estimator.reset({0, 0, kSigma}, {2});
  estimator.predict(Motion::fromTwist({{1, 0, 0}, {0, 0, 0}}, .1));
  estimator.correct({.05, 0, kSigma});  // true parallax has the other sign
  EXPECT_EQ(estimator.fit().degeneracy, WindowDegeneracy::infinity);
  EXPECT_EQ(estimator.estimate().Z(), 2);
  EXPECT_EQ(estimator.estimate().status, DepthStatus::converging);
}

TEST_P(EveryWindowMethod, robotThatComesToRestKeepsWhatItLearnt) {
  Random random(1);
  ObservedPoint run(StillPoint::at(.1, -.05, 1), options(GetParam()));
  run.noise = &random;
  run.see({{.2, 0, 0}, {0, 0, 0}}, 20);
  const double sigma = run.estimate().sigma_chi;
  for (double speed = .2; speed > 1e-5; speed *= 0.9) run.see({{speed, 0, 0}, {0, 0, 0}});
  EXPECT_LT(run.estimate().sigma_chi, 3 * sigma);
  EXPECT_LT(std::abs(run.error()), 0.1);
  EXPECT_EQ(run.status(), DepthStatus::unexcited);
}

// ---- hidden ----

TEST_P(EveryWindowMethod, hiddenPointFollowsTheExactFlow) {
  const Twist twist{{.3, .1, .2}, {.1, -.1, .2}};
  ObservedPoint run(StillPoint::at(.1, -.05, 3), options(GetParam()), 0);
  run.see(twist, 10);
  for (int i = 0; i < 20; ++i) {
    run.hide({{.3, -.1, .1}, {.1, -.1, .1 * i}});
    ASSERT_EQ(run.status(), DepthStatus::coasting);
    ASSERT_NEAR(run.estimate().x, run.point.x(), 1e-10);
    ASSERT_NEAR(run.estimate().y, run.point.y(), 1e-10);
    ASSERT_NEAR(run.error(), 0, 1e-10);
  }
}

TEST_P(EveryWindowMethod, imagesFromBeforeAnOcclusionStillCount) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see(kSideways, 20);
  const double before = run.estimate().sigma_chi;
  run.hide(kSideways, 50);
  EXPECT_EQ(run.estimator.size(), 20u);
  run.see(kSideways);
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_LT(run.estimate().sigma_chi, before / 2) << "the baseline is 3.5 times longer";
}

TEST(WindowOcclusion, predictedSigmaIsTheSpreadOfThePrediction) {
  const Twist twist{{.15, .05, .1}, {0, .05, 0}};
  double sum_chi = 0, sum2_chi = 0, sum_x = 0, sum2_x = 0, sum_y = 0, sum2_y = 0;
  double reported_chi = 0, reported_xy = 0;
  const int draws = 1000;
  Random random(3);
  for (int i = 0; i < draws; ++i) {
    ObservedPoint run(StillPoint::at(.1, -.05, 2));
    run.noise = &random;
    run.estimator.reset(run.measured(), {2});
    run.see(twist, 20);
    run.hide(twist, 20);
    const DepthEstimate e = run.estimate();
    sum_chi += e.chi, sum2_chi += e.chi * e.chi;
    sum_x += e.x, sum2_x += e.x * e.x;
    sum_y += e.y, sum2_y += e.y * e.y;
    reported_chi += e.sigma_chi / draws;
    reported_xy += e.sigma_xy / draws;
  }
  const auto deviation = [&](double sum, double sum2) {
    return std::sqrt(sum2 / draws - std::pow(sum / draws, 2));
  };
  EXPECT_NEAR(reported_chi / deviation(sum_chi, sum2_chi), 1, 0.07);
  const double worse = std::hypot(deviation(sum_x, sum2_x), deviation(sum_y, sum2_y));
  EXPECT_GT(reported_xy, worse / std::sqrt(2) * 0.95);
  EXPECT_LT(reported_xy, worse * 1.05);
}

TEST_P(EveryWindowMethod, isLostWhenPredictedTooVaguelyAndFoundOnReturn) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see({{.05, 0, 0}, {0, 0, 0}}, 20);
  int frames = 0;
  while (run.status() != DepthStatus::lost && frames < 2000) {
    run.hide({{.05, .05, 0}, {0, 0, 0}});
    ++frames;
  }
  EXPECT_EQ(run.status(), DepthStatus::lost);
  EXPECT_GT(run.estimate().sigma_xy, 0.1);
  EXPECT_GT(frames, 20);
  run.see({{.05, .05, 0}, {0, 0, 0}});
  EXPECT_EQ(run.status(), DepthStatus::valid);
}

TEST_P(EveryWindowMethod, pointBehindTheCameraIsLostUntilTheCameraTurnsBack) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see(kSideways, 20);
  const Twist turn{{0, 0, 0}, {0, 1, 0}};
  run.hide(turn, 25);  // 2.5 rad
  EXPECT_EQ(run.status(), DepthStatus::lost);
  EXPECT_TRUE(std::isfinite(run.estimate().x));
  run.hide({{0, 0, 0}, {0, -1, 0}}, 25);
  EXPECT_EQ(run.status(), DepthStatus::coasting);
  EXPECT_NEAR(run.estimate().x, run.point.x(), 1e-6);
  EXPECT_NEAR(run.error(), 0, 1e-6);
  run.see(kSideways);
  EXPECT_EQ(run.status(), DepthStatus::valid);
}

TEST_P(EveryWindowMethod, guessBehindTheCameraIsForgottenByTheImages) {
  // Guessed at 0.1 m, the point would be behind the camera after the first motion.
  ObservedPoint run(StillPoint::at(.2, -.05, 3), options(GetParam()), kSigma, {0.1});
  run.see({{.1, .05, 2}, {0, 0, 0}}, 12);
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_NEAR(run.error(), 0, 1e-6);
}

// ---- contradictions ----

TEST_P(EveryWindowMethod, odometryResetIsRejectedAndThenTheWindowStartsAnew) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see(kSideways, 20);
  // The odometry jumps back to its origin; the camera does not.
  run.estimator.predict(Motion::fromTwist({{-.5, 0, .2}, {0, .6, 0}}, 1));
  const int allowed = WindowOptions().rejectionsInARow;
  for (int i = 0; i < allowed; ++i) {
    run.see(kSideways);
    EXPECT_EQ(run.status(), DepthStatus::rejected);
  }
  run.see(kSideways);
  EXPECT_EQ(run.estimator.size(), 0u);
  EXPECT_EQ(run.status(), DepthStatus::unexcited);
  run.see(kSideways, 15);
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_NEAR(run.error(), 0, 1e-6);
}

TEST_P(EveryWindowMethod, kidnappedRobotStartsAnew) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see(kSideways, 20);
  run.point = StillPoint::at(-.2, .1, 4);
  run.see(kSideways, 60);
  EXPECT_NEAR(run.error(), 0, 1e-6);
  EXPECT_EQ(run.status(), DepthStatus::valid);
}

TEST(WindowMisfit, smallJumpEnlargesSigmaInsteadOfPassingForSure) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2));
  run.see(kSideways, 20);
  const double before = run.estimate().sigma_chi;
  run.estimator.predict(Motion::fromTwist({{0, .3, 0}, {0, 0, 0}}, kDt));  // 3 cm: 9 px
  for (int i = 0; i < 15; ++i) {
    run.see(kSideways);
    const DepthEstimate e = run.estimate();
    EXPECT_LT(std::abs(e.chi - run.point.chi()), 4 * e.sigma_chi) << "image " << i;
  }
  EXPECT_GT(run.estimate().sigma_chi, 1.5 * before);
  run.see(kSideways, 25);
  EXPECT_NEAR(run.error(), 0, 1e-6) << "the jump has left the window";
}

TEST(WindowRobustness, singleOutliersHardlyMoveTheRobustMethod) {
  double worst[2] = {};
  for (WindowMethod method : {WindowMethod::maximumLikelihood, WindowMethod::robust}) {
    ObservedPoint run(StillPoint::at(.1, -.05, 2), options(method));
    run.see(kSideways, 20);
    for (int i = 0; i < 40; ++i) {
      run.hide(kSideways);
      PointMeasurement m = run.measured();
      if (i % 7 == 0) m.x += 10.0 / 600;
      run.estimator.correct(m);
      double& w = worst[method == WindowMethod::robust];
      w = std::max(w, std::abs(run.error()));
    }
  }
  EXPECT_LT(worst[1], 1e-3);
  EXPECT_GT(worst[0], 20 * worst[1]);
}

// ---- bad input ----

TEST_P(EveryWindowMethod, inputThatIsNotANumberIsRejectedAndLeavesTheWindow) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.see(kSideways, 20);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const PointMeasurement& bad :
       {PointMeasurement{nan, 0, kSigma}, PointMeasurement{0, INFINITY, kSigma},
        PointMeasurement{0, 0, nan}, PointMeasurement{0, 0, -1}}) {
    run.hide(kSideways);
    run.estimator.correct(bad);
    EXPECT_EQ(run.status(), DepthStatus::rejected);
    EXPECT_NEAR(run.estimate().x, run.point.x(), 1e-6) << "predicted";
  }
  Motion motion = Motion::fromTwist(kSideways, kDt);
  motion.t.x() = nan;
  const DepthEstimate before = run.estimate();
  run.estimator.predict(motion);
  motion = Motion::fromTwist(kSideways, kDt);
  motion.dt = 0;
  run.estimator.predict(motion);
  EXPECT_EQ(run.estimate().x, before.x);
  EXPECT_EQ(run.estimator.size(), 20u);
  run.see(kSideways);
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_NEAR(run.error(), 0, 1e-6);
}

TEST(WindowReset, unusableMeasurementDoesNotStart) {
  WindowDepthEstimator estimator;
  estimator.reset({std::nan(""), 0, kSigma}, {2});
  EXPECT_EQ(estimator.estimate().status, DepthStatus::unset);
}

// ---- direct depths ----

TEST_P(EveryWindowMethod, measuredDepthIsFused) {
  ObservedPoint run(StillPoint::at(.1, -.05, 2), options(GetParam()));
  run.estimator.correctDepth({2.02, 0.002});
  EXPECT_NEAR(run.estimate().Z(), 2.02, 1e-3);
  EXPECT_EQ(run.status(), DepthStatus::valid);
  run.hide(kSideways, 3);
  run.estimator.correctDepth({2.0, 0.0001});  // while hidden
  EXPECT_NEAR(run.error(), 0, 1e-3);
  EXPECT_EQ(run.status(), DepthStatus::coasting);
  EXPECT_NEAR(run.estimate().sigma_chi, 0.0001, 1e-5);
}

TEST_P(EveryWindowMethod, narrowPriorIsAMeasurementAndAWideOneIsAGuess) {
  ObservedPoint narrow(StillPoint::at(.1, -.05, 2), options(GetParam()), kSigma, {2.1, 0.01});
  EXPECT_EQ(narrow.status(), DepthStatus::valid);
  EXPECT_NEAR(narrow.estimate().sigma_chi, 0.01, 1e-9);
  ObservedPoint wide(StillPoint::at(.1, -.05, 2), options(GetParam()), kSigma, {50});
  wide.see(kSideways, 20);
  EXPECT_NEAR(wide.error(), 0, 1e-6) << "without any trace of the guess";
}

// ---- options ----

TEST(WindowSpacing, keepsALongerBaselineWithAsManyImages) {
  WindowOptions spaced;
  spaced.spacing_s = 0.5;
  spaced.images = 5;
  WindowOptions dense;
  dense.images = 5;
  ObservedPoint a(StillPoint::at(.1, -.05, 2), spaced), b(StillPoint::at(.1, -.05, 2), dense);
  a.see(kSideways, 60);
  b.see(kSideways, 60);
  EXPECT_EQ(a.estimator.size(), 5u);
  EXPECT_LT(a.estimate().sigma_chi, b.estimate().sigma_chi / 3);
  EXPECT_NEAR(a.error(), 0, 1e-6);
}

TEST(TwoFrameLeastSquares, knowsTheLastTwoImagesOnly) {
  TwoFrameLeastSquares estimator;
  StillPoint point = StillPoint::at(.1, -.05, 2);
  estimator.reset(point.measured(kSigma), {1});
  for (int i = 0; i < 5; ++i) {
    point.move({{1, 0, 0}, {0, 0, 0}}, kDt);
    estimator.predict(Motion::fromTwist({{1, 0, 0}, {0, 0, 0}}, kDt));
    estimator.correct(point.measured(kSigma));
    EXPECT_EQ(estimator.size(), 1u);
    EXPECT_NEAR(estimator.estimate().Z(), 2, 1e-12);
  }
  // Two measurements, a decimetre apart: sqrt(2) sigma / 0.1 m.
  EXPECT_NEAR(estimator.estimate().sigma_chi, std::sqrt(2) * kSigma / 0.1, 1e-9);
  const auto clone = estimator.clone();
  clone->reset(point.measured(kSigma), {1});
  EXPECT_EQ(estimator.size(), 1u);
  EXPECT_NEAR(estimator.estimate().Z(), 2, 1e-12);
}

}  // namespace
}  // namespace depthservo
