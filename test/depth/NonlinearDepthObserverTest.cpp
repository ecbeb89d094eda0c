#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

using test::Random;
using test::StillPoint;

constexpr double kDt = 1.0 / 30;
constexpr double kSigma = 0.5 / 600;

Twist lateral(double speed) { return {{speed, 0, 0}, {0, 0, 0}}; }

/// A point and its observer, moved together.
struct ObservedPoint {
  explicit ObservedPoint(const StillPoint& still, double guess_Z = 1,
                         const NonlinearDepthObserver::Options& options = {}, double sigma = kSigma)
      : point(still), observer(options), measurementSigma(sigma) {
    observer.reset(point.measured(sigma), {guess_Z});
  }

  void move(const Twist& twist, double dt = kDt) {
    point.move(twist, dt);
    observer.predict(Motion::fromTwist(twist, dt));
  }
  void frame(const Twist& twist, double dt = kDt) {
    move(twist, dt);
    observer.correct(point.measured(measurementSigma));
  }
  void frames(int n, const Twist& twist) {
    for (int i = 0; i < n; ++i) frame(twist);
  }

  DepthStatus status() const { return observer.estimate().status; }
  double relativeError() const { return observer.estimate().Z() / point.Z() - 1; }

  StillPoint point;
  NonlinearDepthObserver observer;
  double measurementSigma;
};

// ---- gains ----

TEST(ObserverGains, fromSettlingTimeSettlesToTwoPercentInThatTime) {
  const double W = 0.1, settling = 1.5;
  NonlinearDepthObserver::Options options;
  options.gains = ObserverGains::fromSettlingTime(settling, W);
  ObservedPoint run(StillPoint::at(-.1, .05, 1), 1 / 0.9, options, 0);
  const double initial = 1 - 0.9, dt = 1e-2;
  for (int i = 0; i < 300; ++i) {
    run.frame(lateral(W), dt);
    const double t = (i + 1) * dt, wn = options.gains.wn;
    const double expected = initial * (1 + wn * t) * std::exp(-wn * t);
    ASSERT_NEAR(1 - run.observer.estimate().chi, expected, 1e-2 * initial) << t;
  }
}

TEST(ObserverGains, scheduledSettlesAlikeAtAnyExcitationAboveTheLeast) {
  std::vector<double> errors;
  for (double W : {0.02, 0.1, 0.4}) {
    NonlinearDepthObserver::Options options;
    options.gains = ObserverGains::scheduled(1.5, 0.01);
    ObservedPoint run(StillPoint::at(-.1, 0, 1), 1 / 0.9, options, 0);
    run.frames(30, lateral(W));
    errors.push_back(1 - run.observer.estimate().chi);
  }
  EXPECT_NEAR(errors[0], errors[1], 1e-6);
  EXPECT_NEAR(errors[2], errors[1], 1e-6);
}

TEST(ObserverGains, scheduledNeverExceedsTheGainAtTheLeastExcitation) {
  const ObserverGains gains = ObserverGains::scheduled(1.5, 0.01);
  const double largest = gains.wn2At(1e-4) / 1e-4;  // k_3
  EXPECT_NEAR(gains.wn2At(1e-6) / 1e-6, largest, 1e-9 * largest);
  EXPECT_NEAR(gains.wn2At(1e-2), gains.wn * gains.wn, 1e-12) << "and the frequency is kept above";
}

/// Error (x, y, chi) after one frame of pure lateral motion at excitation W, per unit error before.
Eigen::Matrix3d errorTransition(const ObserverGains& gains, double W, double dt) {
  NonlinearDepthObserver::Options options;
  options.gains = gains;
  options.gate = 10;
  const double h = 1e-6;
  const auto after = [&](const Eigen::Vector3d& e) {
    StillPoint point = StillPoint::at(.1, -.05, 1);
    NonlinearDepthObserver observer(options);
    observer.reset({point.x() + e.x(), point.y() + e.y(), 0}, {1 / (point.chi() + e.z())});
    point.move(lateral(W), dt);
    observer.predict(Motion::fromTwist(lateral(W), dt));
    observer.correct(point.measured());
    const DepthEstimate s = observer.estimate();
    return Eigen::Vector3d(s.x - point.x(), s.y - point.y(), s.chi - point.chi());
  };
  Eigen::Matrix3d T;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(i);
    T.col(i) = (after(step) - after(-step)) / (2 * h);
  }
  return T;
}

TEST(NonlinearDepthObserver, discretePolesAreThoseOfTheContinuousObserver) {
  struct Case {
    double k, k_3, W, dt;
  };
  for (const Case& c :
       {Case{48, 44000, .08, 1. / 30}, Case{48, 44000, .114, 1. / 30}, Case{48, 44000, .5, 1. / 30},
        Case{20, 8192, .1, 1. / 100}, Case{7.8, 1500, .1, 1. / 10}, Case{20, 1e6, .3, 1. / 60},
        Case{10, 100, .01, 1. / 30}, Case{200, 1e6, .2, 1.}}) {
    Eigen::Vector3cd poles = errorTransition({c.k, c.k_3, 0, 0}, c.W, c.dt).eigenvalues();
    const std::complex<double> root =
        std::sqrt(std::complex<double>(c.k * c.k / 4 - c.k_3 * c.W * c.W));
    std::vector<std::complex<double>> expected{std::exp((-c.k / 2 + root) * c.dt),
                                               std::exp((-c.k / 2 - root) * c.dt),
                                               std::exp(-c.k * c.dt)};
    for (const auto& e : expected) {  // nearest one, each used once
      Eigen::Index nearest;
      const double distance = (poles.array() - e).abs().minCoeff(&nearest);
      EXPECT_LT(distance, 2e-6) << "k " << c.k << ", k_3 " << c.k_3 << ", W " << c.W << ", dt "
                                << c.dt << ": no pole at " << e;
      poles[nearest] = 1e9;
    }
  }
}

// ---- convergence ----

TEST(NonlinearDepthObserver, convergesFromAnyGuessOnLateralMotion) {
  for (double Z : {0.3, 1.0, 4.0}) {
    for (double factor : {0.1, 0.2, 0.4, 1.0, 3.0, 10.0}) {
      ObservedPoint run(StillPoint::at(-.3, .1, Z), factor * Z);
      run.frames(90, lateral(0.1));
      EXPECT_LT(std::abs(run.relativeError()), 0.02) << "Z " << Z << ", guess x " << factor;
      EXPECT_EQ(run.status(), DepthStatus::valid) << "Z " << Z << ", guess x " << factor;
    }
  }
}

TEST(NonlinearDepthObserver, convergesFromUnusableGuesses) {
  for (double guess : {0.0, -1.0, 1e-300, 1e300, std::nan(""), kInf, -kInf}) {
    ObservedPoint run(StillPoint::at(-.1, .1, 1), guess);
    run.frames(90, lateral(0.1));
    EXPECT_LT(std::abs(run.relativeError()), 0.02) << guess;
  }
}

TEST(NonlinearDepthObserver, followsTheDepthWhileApproaching) {
  ObservedPoint run(StillPoint::at(.25, .2, 2.5), 4);
  run.frames(120, {{.02, 0, .4}, {0, .05, .1}});
  EXPECT_LT(std::abs(run.relativeError()), 0.02);
}

TEST(NonlinearDepthObserver, estimateDoesNotDependOnHowTheMotionIsCut) {
  const Twist twist{{.1, -.05, .2}, {.1, .2, -.3}};
  ObservedPoint whole(StillPoint::at(.1, .1, 1), 2), cut(StillPoint::at(.1, .1, 1), 2);
  for (int i = 0; i < 40; ++i) {
    whole.frame(twist);
    cut.move(twist, 0.3 * kDt);
    cut.move(twist, 0.5 * kDt);
    cut.frame(twist, 0.2 * kDt);
  }
  EXPECT_NEAR(cut.observer.estimate().chi, whole.observer.estimate().chi, 1e-9);
  EXPECT_NEAR(cut.observer.estimate().sigma_chi, whole.observer.estimate().sigma_chi, 1e-9);
}

TEST(NonlinearDepthObserver, translationTooLongByTwoPercentMakesDepthTooLargeByTwoPercent) {
  ObservedPoint run(StillPoint::at(-.2, .1, 1), 1.5);
  for (int i = 0; i < 300; ++i) {
    const Twist twist = lateral(i % 60 < 30 ? 0.1 : -0.1);
    run.point.move(twist, kDt);
    run.observer.predict(Motion::fromTwist(lateral(1.02 * twist.linear.x()), kDt));
    run.observer.correct(run.point.measured(kSigma));
  }
  EXPECT_NEAR(run.relativeError(), 0.02, 1e-3);
}

// ---- no information ----

TEST(NonlinearDepthObserver, cameraAtRestKeepsDepthAndSigma) {
  ObservedPoint run(StillPoint::at(.1, -.2, 1), 2.5);
  const double sigma = run.observer.estimate().sigma_chi;
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    run.move({}, kDt);
    run.observer.correct(
        {run.point.x() + random.normal(kSigma), run.point.y() + random.normal(kSigma), kSigma});
    if (i >= 2) {
      ASSERT_EQ(run.status(), DepthStatus::unexcited) << "frame " << i;
    }
  }
  EXPECT_NEAR(run.observer.estimate().Z(), 2.5, 1e-9);
  EXPECT_NEAR(run.observer.estimate().sigma_chi, sigma, 1e-9);
}

TEST(NonlinearDepthObserver, pureRotationKeepsTheRatioToTheTrueDepthAndSigma) {
  ObservedPoint run(StillPoint::at(.1, -.2, 1), 2.5);
  const double sigma = run.observer.estimate().sigma_chi;
  for (int i = 0; i < 200; ++i) {
    const double t = i * kDt;
    run.frame({{0, 0, 0}, {.3 * std::cos(3 * t), .2 * std::sin(3 * t), .3}});
    if (i >= 2) {
      ASSERT_EQ(run.status(), DepthStatus::unexcited) << "frame " << i;
    }
    ASSERT_NEAR(run.relativeError(), 1.5, 1e-9);
  }
  const DepthEstimate e = run.observer.estimate();
  EXPECT_NEAR(e.sigma_chi / e.chi, sigma * 2.5, 1e-9) << "relative sigma, as the depth turns too";
}

TEST(NonlinearDepthObserver, motionAlongTheRayKeepsTheErrorOfTheDepthAndSigma) {
  StillPoint point = StillPoint::at(.1, -.2, 2);
  const Twist alongTheRay{-0.1 * point.cP() / point.Z(), {0, 0, 0}};
  ObservedPoint run(point, 1 / (point.chi() + 0.2));
  const double sigma = run.observer.estimate().sigma_chi;
  for (int i = 0; i < 60; ++i) {
    run.frame(alongTheRay);
    if (i >= 2) {
      ASSERT_EQ(run.status(), DepthStatus::unexcited) << "frame " << i;
    }
  }
  // Z moves by the distance travelled, from the guess as from the truth.
  EXPECT_NEAR(run.observer.estimate().Z() - run.point.Z(), 1 / (0.5 + 0.2) - 2, 1e-9);
  const DepthEstimate e = run.observer.estimate();
  EXPECT_NEAR(e.sigma_Z(), sigma / (0.7 * 0.7), 1e-9);
}

TEST(NonlinearDepthObserver, targetAtTheImageCentreWithAnUnderestimatedGuessIsUnexcitedAndHeld) {
  // The error of an underestimated depth grows by itself on the approach, and nothing corrects it:
  // Z is held at the nearest of its range.
  NonlinearDepthObserver observer({}, {.5, 20});
  StillPoint point = StillPoint::at(1e-5, -1e-5, 4);
  const Twist ahead{{0, 0, .3}, {0, 0, 0}};
  observer.reset(point.measured(kSigma), {1.6});
  for (int i = 0; i < 240; ++i) {
    point.move(ahead, kDt);
    observer.predict(Motion::fromTwist(ahead, kDt));
    observer.correct(point.measured(kSigma));
    if (i >= 2) {
      ASSERT_EQ(observer.estimate().status, DepthStatus::unexcited) << "frame " << i;
    }
  }
  EXPECT_NEAR(observer.estimate().Z(), .5, 1e-6);
  EXPECT_NEAR(point.Z(), 1.6, 1e-6) << "while the truth is still far";
}

TEST(NonlinearDepthObserver, statusBecomesUnexcitedWithinThreeFramesAfterTheCameraStops) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(90, lateral(.1));
  ASSERT_EQ(run.status(), DepthStatus::valid);
  const double Z = run.observer.estimate().Z();
  run.frames(3, {});
  EXPECT_EQ(run.status(), DepthStatus::unexcited);
  run.frames(300, {});
  EXPECT_NEAR(run.observer.estimate().Z(), Z, 1e-9);
}

TEST(NonlinearDepthObserver, excitationIsTheSpeedAcrossTheLineOfSight) {
  const Twist twist{{.03, -.02, .2}, {.1, .2, .3}};
  ObservedPoint run(StillPoint::at(.1, -.2, 1.5), 1.5);
  run.frame(twist, 1e-3);
  const double x = run.point.x(), y = run.point.y();
  const Eigen::Vector3d& v = twist.linear;
  const double expected = std::hypot(x * v.z() - v.x(), y * v.z() - v.y());
  EXPECT_NEAR(run.observer.estimate().excitation, expected, 1e-3 * expected);
}

TEST(NonlinearDepthObserver, windowedExcitationObeysItsEquation) {
  NonlinearDepthObserver::Options options;
  options.window_s = 0.8;
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 1, options);
  run.frames(30, lateral(.1));
  const double expected = 0.1 * 0.1 * options.window_s * (1 - std::exp(-1 / options.window_s));
  EXPECT_NEAR(run.observer.windowedExcitation(), expected, 0.03 * expected);
}

TEST(NonlinearDepthObserver, noiseOfMeasuredOdometryDoesNotPullTheDepthOfACameraAtRest) {
  NonlinearDepthObserver::Options options;
  options.odometry = OdometryNoise::white(.005, .002);
  StillPoint point = StillPoint::at(.1, .05, 1.5);
  NonlinearDepthObserver observer(options);
  observer.reset(point.measured(kSigma), {1});
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    const Twist noise{{random.normal(.005), random.normal(.005), random.normal(.005)},
                      {random.normal(.002), random.normal(.002), random.normal(.002)}};
    observer.predict(Motion::fromTwist(noise, kDt));
    observer.correct(
        {point.x() + random.normal(kSigma), point.y() + random.normal(kSigma), kSigma});
  }
  EXPECT_NEAR(observer.estimate().Z(), 1, 0.02);
  EXPECT_GT(observer.estimate().sigma_chi, 0.9 * DepthPrior::kWideSigma_chi);
}

// ---- hidden, lost, rejected ----

TEST(NonlinearDepthObserver, coastsWhileHiddenAndIsRightOnReturn) {
  const auto twistAt = [](double t) {
    return Twist{{.1 * std::cos(2 * t), .05, .05}, {.1, -.1, .2 * std::sin(t)}};
  };
  ObservedPoint run(StillPoint::at(-.1, -.1, 1.2), 2.5);
  double t = 0;
  for (int i = 0; i < 120; ++i, t += kDt) run.frame(twistAt(t));
  ASSERT_LT(std::abs(run.relativeError()), 0.01);
  const double sigma = run.observer.estimate().sigma_chi;
  for (int i = 0; i < 60; ++i, t += kDt) {
    run.move(twistAt(t));
    ASSERT_EQ(run.status(), DepthStatus::coasting);
    const DepthEstimate e = run.observer.estimate();
    ASSERT_LT(std::abs(run.relativeError()), 0.01);
    ASSERT_LT(std::hypot(e.x - run.point.x(), e.y - run.point.y()), 2 / 600.);
  }
  EXPECT_GT(run.observer.estimate().sigma_chi, 0.5 * sigma);
  run.frame(twistAt(t));
  EXPECT_EQ(run.status(), DepthStatus::valid) << "measured again, and believed";
  EXPECT_LT(std::abs(run.relativeError()), 0.01);
}

TEST(NonlinearDepthObserver, unlearntDepthIsLostWhileHiddenAndLearntOnReturn) {
  ObservedPoint run(StillPoint::at(-.2, 0, 1), 3);
  for (int i = 0; i < 45; ++i) run.move(lateral(.1));
  EXPECT_EQ(run.status(), DepthStatus::lost) << "predicted too vaguely";
  run.frames(60, lateral(.1));
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_LT(std::abs(run.relativeError()), 0.02);
}

TEST(NonlinearDepthObserver, pointBehindTheCameraIsLostUntilItIsMeasuredAgain) {
  ObservedPoint run(StillPoint::at(.02, .01, 1), 1);
  run.move({{0, 0, 3}, {0, 0, 0}}, 0.5);
  ASSERT_LT(run.point.Z(), 0);
  EXPECT_EQ(run.status(), DepthStatus::lost);
  run.observer.predict(Motion::fromTwist(lateral(.01), kDt));
  EXPECT_EQ(run.status(), DepthStatus::lost) << "still behind: where it is is not known";
  run.point.move({{0, 0, -4}, {0, 0, 0}}, 0.5);  // back, without odometry
  run.point.move({{.2, .1, 0}, {0, 0, 0}}, 1);
  run.frames(90, lateral(.1));
  EXPECT_EQ(run.status(), DepthStatus::valid);
  EXPECT_LT(std::abs(run.relativeError()), 0.02);
}

TEST(NonlinearDepthObserver, jumpIsRejectedFiveTimesThenBelieved) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(90, lateral(.1));
  const double Z = run.observer.estimate().Z();
  for (int i = 0; i < 5; ++i) {
    run.move(lateral(.1));
    run.observer.correct({run.point.x() + .3, run.point.y(), kSigma});
    ASSERT_EQ(run.status(), DepthStatus::rejected) << i;
    ASSERT_NEAR(run.observer.estimate().x, run.point.x(), 1e-3) << "predicted, not believed";
    ASSERT_NEAR(run.observer.estimate().Z(), Z, 1e-3 * Z);
  }
  run.move(lateral(.1));
  run.observer.correct({run.point.x() + .3, run.point.y(), kSigma});
  EXPECT_NE(run.status(), DepthStatus::rejected);
  EXPECT_NEAR(run.observer.estimate().x, run.point.x() + .3, 1e-12);
  EXPECT_NEAR(run.observer.estimate().Z(), Z, 1e-3 * Z) << "the depth at hand is the new guess";
}

TEST(NonlinearDepthObserver, oneOutlierDoesNotShowInTheDepth) {
  ObservedPoint clean(StillPoint::at(-.1, .1, 1), 2), disturbed(StillPoint::at(-.1, .1, 1), 2);
  for (int i = 0; i < 90; ++i) {
    clean.frame(lateral(.1));
    disturbed.move(lateral(.1));
    const double jump = i == 60 ? 0.4 : 0;
    disturbed.observer.correct({disturbed.point.x(), disturbed.point.y() + jump, kSigma});
  }
  EXPECT_NEAR(disturbed.observer.estimate().Z(), clean.observer.estimate().Z(), 2e-3);
}

TEST(NonlinearDepthObserver, unusableMeasurementIsRejectedAndLeavesTheEstimate) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(20, lateral(.1));
  run.move(lateral(.1));
  const DepthEstimate before = run.observer.estimate();
  for (const PointMeasurement& bad :
       {PointMeasurement{std::nan(""), 0, kSigma}, PointMeasurement{0, kInf, kSigma},
        PointMeasurement{0, 0, std::nan("")}, PointMeasurement{0, 0, -1}}) {
    run.observer.correct(bad);
    const DepthEstimate after = run.observer.estimate();
    EXPECT_EQ(after.status, DepthStatus::rejected);
    EXPECT_EQ(after.x, before.x);
    EXPECT_EQ(after.chi, before.chi);
    EXPECT_EQ(after.sigma_chi, before.sigma_chi);
  }
}

TEST(NonlinearDepthObserver, secondMeasurementOfTheSameInstantChangesNothing) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(20, lateral(.1));
  const DepthEstimate before = run.observer.estimate();
  run.observer.correct({before.x + 1e-3, before.y, kSigma});
  EXPECT_EQ(run.observer.estimate().chi, before.chi);
  EXPECT_EQ(run.observer.estimate().sigma_chi, before.sigma_chi);
}

TEST(NonlinearDepthObserver, motionThatCannotBeUsedIsIgnored) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(20, lateral(.1));
  const DepthEstimate before = run.observer.estimate();
  for (double dt : {0.0, -0.1, std::nan(""), kInf}) {
    run.observer.predict(Motion::fromTwist(lateral(.1), dt));
  }
  run.observer.predict(Motion::fromTwist(lateral(std::nan("")), kDt));
  run.observer.predict(Motion::fromTwist(lateral(kInf), kDt));
  EXPECT_EQ(run.observer.estimate().x, before.x);
  EXPECT_EQ(run.observer.estimate().chi, before.chi);
  EXPECT_EQ(run.observer.estimate().status, before.status);
}

// ---- range, depth measurements, copies ----

TEST(NonlinearDepthObserver, depthNeverLeavesItsRange) {
  const DepthRange range{0.5, 2};
  for (double guess : {0.01, 0.6, 100.0}) {
    NonlinearDepthObserver observer({}, range);
    StillPoint point = StillPoint::at(-.1, .1, 8);  // beyond the range
    observer.reset(point.measured(kSigma), {guess});
    for (int i = 0; i < 60; ++i) {
      point.move(lateral(.1), kDt);
      observer.predict(Motion::fromTwist(lateral(.1), kDt));
      observer.correct(point.measured(kSigma));
      ASSERT_GE(observer.estimate().Z(), range.Z_min);
      ASSERT_LE(observer.estimate().Z(), range.Z_max * (1 + 1e-15));
    }
    EXPECT_NEAR(observer.estimate().Z(), range.Z_max, 1e-9);
    EXPECT_EQ(observer.estimate().status, DepthStatus::converging) << "held there, not found";
  }
}

TEST(NonlinearDepthObserver, depthNearerThanItsRangeIsHeldAtItsEndAndNotCalledValid) {
  NonlinearDepthObserver observer({}, {2, 20});
  StillPoint point = StillPoint::at(-.2, .1, 1);
  observer.reset(point.measured(kSigma), {4});
  for (int i = 0; i < 60; ++i) {
    point.move(lateral(.05), kDt);
    observer.predict(Motion::fromTwist(lateral(.05), kDt));
    observer.correct(point.measured(kSigma));
  }
  EXPECT_NEAR(observer.estimate().Z(), 2, 1e-9);
  EXPECT_EQ(observer.estimate().status, DepthStatus::converging);
}

TEST(NonlinearDepthObserver, correctDepthWeighsTheMeasurementByItsSigma) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.observer.correctDepth({1, 1e-3});
  EXPECT_NEAR(run.observer.estimate().Z(), 1, 1e-6);
  EXPECT_NEAR(run.observer.estimate().sigma_chi, 1e-3, 1e-6);
  run.observer.correctDepth({0.8, 1e-3});
  EXPECT_NEAR(run.observer.estimate().chi, 0.5 * (1 + 1 / 0.8), 1e-6) << "two of equal weight";
  EXPECT_NEAR(run.observer.estimate().sigma_chi, 1e-3 / std::sqrt(2), 1e-6);
}

TEST(NonlinearDepthObserver, unusableDepthMeasurementIsIgnored) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  for (const DepthPrior& bad :
       {DepthPrior{0, 1}, DepthPrior{-1, 1}, DepthPrior{std::nan(""), 1}, DepthPrior{kInf, 1},
        DepthPrior{1, -1}, DepthPrior{1, std::nan("")}, DepthPrior{1, kInf}}) {
    run.observer.correctDepth(bad);
    EXPECT_EQ(run.observer.estimate().Z(), 2);
  }
}

TEST(NonlinearDepthObserver, isUnsetUntilAUsableMeasurement) {
  NonlinearDepthObserver observer;
  observer.predict(Motion::fromTwist(lateral(.1), kDt));
  observer.correct({.1, .1, kSigma});
  observer.correctDepth({1, .1});
  EXPECT_EQ(observer.estimate().status, DepthStatus::unset);
  observer.reset({std::nan(""), 0, kSigma}, {});
  EXPECT_EQ(observer.estimate().status, DepthStatus::unset);
  observer.reset({.1, .1, kSigma}, {3});
  EXPECT_NE(observer.estimate().status, DepthStatus::unset);
  EXPECT_NEAR(observer.estimate().Z(), 3, 1e-15);
}

TEST(NonlinearDepthObserver, cloneIsIndependent) {
  ObservedPoint run(StillPoint::at(-.1, .1, 1), 2);
  run.frames(10, lateral(.1));
  const auto clone = run.observer.clone();
  EXPECT_EQ(clone->estimate().chi, run.observer.estimate().chi);
  const double before = run.observer.estimate().chi;
  clone->predict(Motion::fromTwist(lateral(.1), kDt));
  clone->correct({.2, .1, kSigma});
  clone->correctDepth({5, 1e-3});
  EXPECT_EQ(run.observer.estimate().chi, before);
  EXPECT_NE(clone->estimate().chi, before);
}

}  // namespace
}  // namespace depthservo
