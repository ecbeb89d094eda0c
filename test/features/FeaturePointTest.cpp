#include <gtest/gtest.h>
#include <visp3/core/vpExponentialMap.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/features/FeaturePoint.h"
#include "support/FourPointScene.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

vpColVector vispTwist(const Twist& u) {
  vpColVector v(6);
  for (unsigned j = 0; j < 3; ++j) {
    v[j] = u.linear[j];
    v[j + 3] = u.angular[j];
  }
  return v;
}

/// A still point and the feature that observes it, moved together.
struct ObservedFeature {
  explicit ObservedFeature(const StillPoint& still, double guess_Z = 1,
                           const FeaturePoint& kind = {})
      : point(still), feature(kind) {
    feature.set_Z(guess_Z);
    measure();
    feature.observe(vpColVector(6, 0.), kPeriod_s);
  }
  void measure() {
    feature.set_x(point.x());
    feature.set_y(point.y());
  }
  void frame(const Twist& u) {
    point.move(u, kPeriod_s);
    measure();
    feature.observe(vispTwist(u), kPeriod_s);
  }
  void hiddenFrame(const Twist& u) {
    point.move(u, kPeriod_s);
    feature.observe(vispTwist(u), kPeriod_s);
  }
  void frames(int n, const Twist& u) {
    for (int i = 0; i < n; ++i) frame(u);
  }

  StillPoint point;
  FeaturePoint feature;
};

const Twist kLateral{{.1, .03, 0}, {0, 0, 0}};

// ---- what errs on the robot ----

double relativeSigmaAfter(const FeaturePoint& kind, double seconds) {
  ObservedFeature observed(StillPoint::at(.1, -.1, 1), 1, kind);
  observed.frames(static_cast<int>(seconds / kPeriod_s), kLateral);
  return observed.feature.estimate().sigma_Z() / observed.feature.estimate().Z();
}

TEST(Errors, ofAnArmAreReckonedWithFromTheStart) {
  FeaturePoint perfect, wheeled, arm;
  perfect.setErrors(ErrorProfile());
  wheeled.setErrors(ErrorProfile::typical());
  arm.setErrors(ErrorProfile::arm());
  const double usual = relativeSigmaAfter({}, 5);
  EXPECT_EQ(usual, relativeSigmaAfter(arm, 5));
  EXPECT_GT(usual, 2 * relativeSigmaAfter(perfect, 5));
  EXPECT_GT(relativeSigmaAfter(wheeled, 5), 1.5 * usual);
  EXPECT_GT(relativeSigmaAfter(wheeled, 60), ErrorProfile::typical().scale);
}

TEST(Errors, setLateStartTheDepthAnewWhereItIs) {
  ObservedFeature observed(StillPoint::at(.1, -.1, 1));
  observed.frames(60, kLateral);
  const DepthEstimate before = observed.feature.estimate();
  observed.feature.setErrors(ErrorProfile::typical());
  observed.frame(kLateral);
  EXPECT_GT(observed.feature.estimate().sigma_chi, 5 * before.sigma_chi);
  observed.frames(60, kLateral);
  EXPECT_NEAR(observed.feature.estimate().Z(), 1, .03);
}

/// The loop of the example fourPointsObserved.
TEST(Errors, ofAnArmLeaveTheExamplesPointsValidWithin3s) {
  vpHomogeneousMatrix wMc(vpTranslationVector(.35, -.25, -.9),
                          vpRotationMatrix(vpThetaUVector(.2, .3, .4)));
  vpPoint target[4] = {vpPoint(-.1, -.1, 0), vpPoint(.1, -.1, 0), vpPoint(.1, .1, 0),
                       vpPoint(-.1, .1, 0)};
  FeaturePoint s[4];
  vpFeaturePoint sd[4];
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(.3);
  for (int i = 0; i < 4; ++i) {
    target[i].track(vpHomogeneousMatrix(0, 0, .5, 0, 0, 0));
    vpFeatureBuilder::create(sd[i], target[i]);
    s[i].set_Z(3);
    task.addFeature(s[i], sd[i]);
  }
  vpColVector v(6, 0.);
  int firstValid = 0;
  for (int frame = 0; frame < 90 && firstValid == 0; ++frame) {
    int valid = 0;
    for (int i = 0; i < 4; ++i) {
      target[i].track(wMc.inverse());
      s[i].set_x(target[i].get_x());
      s[i].set_y(target[i].get_y());
      s[i].observe(v, kPeriod_s);
      valid += s[i].estimate().status == DepthStatus::valid;
    }
    if (valid == 4) firstValid = frame;
    v = task.computeControlLaw();
    wMc = wMc * vpExponentialMap::direct(v, kPeriod_s);
  }
  EXPECT_GT(firstValid, 0);
}

// ---- in the servo loop ----

/// Each depth at the end is right to the tolerance, or within its own two sigma where a point moved
/// along its ray and could not tell more. The depth used may differ from the estimate: it is
/// blended.
void expectKnownDepths(const std::vector<FeaturePoint>& s, const ServoOutcome& outcome,
                       double tolerance) {
  for (std::size_t i = 0; i < s.size(); ++i) {
    const DepthEstimate& e = s[i].estimate();
    EXPECT_LT(std::abs(outcome.relativeDepth[i]), std::max(tolerance, 2 * e.sigma_Z() / e.Z()))
        << i;
  }
}

class GuessedDepth : public ::testing::TestWithParam<double> {};

TEST_P(GuessedDepth, neverKeepsTheServoFromItsGoal) {
  for (const auto type : {vpServo::CURRENT, vpServo::MEAN}) {
    SCOPED_TRACE(type);
    std::vector<FeaturePoint> s(4);  // before the task, as with ViSP's own
    for (FeaturePoint& f : s) f.set_Z(GetParam());
    const ServoOutcome outcome = servo(
        s, type, 400, [&](std::size_t i, const vpColVector& v) { s[i].observe(v, kPeriod_s); });
    for (const vpColVector& v : outcome.commands) ASSERT_TRUE(std::isfinite(v.sum()));
    EXPECT_LT(outcome.error, 1.5e-3);
    expectKnownDepths(s, outcome, .03);
  }
}

INSTANTIATE_TEST_SUITE_P(Guesses, GuessedDepth,
                         ::testing::Values(1.0, 3.0, 0.3, 10.0, 0.1, 0.0, -1.0, kNaN, kInf, -kInf,
                                           1e-300, 1e300));

TEST(FeaturePoint, guessThreeTimesWrongEndsWithinThreePercent) {
  for (const auto type : {vpServo::CURRENT, vpServo::MEAN}) {
    for (double guess : {3.0, 0.3}) {
      std::vector<FeaturePoint> s(4);
      for (FeaturePoint& f : s) f.set_Z(guess);
      const ServoOutcome outcome = servo(
          s, type, 400, [&](std::size_t i, const vpColVector& v) { s[i].observe(v, kPeriod_s); });
      for (double error : outcome.relativeDepth) EXPECT_LT(std::abs(error), 0.03) << guess;
    }
  }
}

TEST(FeaturePoint, garbageInAnyInputNeverStallsTheServo) {
  // Every tenth call of each feature is spoilt; all frames stay finite and the servo converges.
  std::vector<FeaturePoint> s(4);
  for (FeaturePoint& f : s) f.set_Z(3);
  const double bad[] = {kNaN, kInf, -kInf};
  std::vector<int> calls{0, 3, 6, 9};  // not all features in the same frame
  const ServoOutcome outcome =
      servo(s, vpServo::CURRENT, 600, [&](std::size_t i, const vpColVector& v) {
        const int call = ++calls[i];
        const double x = bad[call % 3];
        switch (call % 70) {
          case 0:
            return s[i].observe(v, x);
          case 10:
            return s[i].observe(vpColVector(6, x), kPeriod_s);
          case 20:
            return s[i].observe(vpColVector(3, 0.1), kPeriod_s);
          case 30:
            return s[i].observe(v, call % 2 ? 0.0 : -kPeriod_s);
          case 40:
            s[i].set_x(x);
            break;
          case 50:
            s[i].set_Z(call % 2 ? x : -1.0);
            break;
          case 60:
            s[i].setDepth(x, call % 2 ? x : 1);
            break;
          default:
            break;
        }
        s[i].observe(v, kPeriod_s);
        EXPECT_GT(s[i].get_Z(), 0);
        EXPECT_TRUE(std::isfinite(s[i].get_x() + s[i].get_y() + s[i].get_Z()));
      });
  for (const vpColVector& v : outcome.commands) ASSERT_TRUE(std::isfinite(v.sum()));
  EXPECT_LT(outcome.error, 1.5e-3);
  expectKnownDepths(s, outcome, .15);  // each refused twist is a motion nobody told of
}

TEST(FeaturePoint, takesAnyEstimator) {
  std::vector<FeaturePoint> s(4, FeaturePoint(ConstantDepth()));
  for (FeaturePoint& f : s) f.set_Z(2);
  servo(s, vpServo::CURRENT, 30,
        [&](std::size_t i, const vpColVector& v) { s[i].observe(v, kPeriod_s); });
  for (const FeaturePoint& f : s) EXPECT_EQ(f.estimate().Z(), 2);
}

// ---- what never leaves it ----

TEST(FeaturePoint, nothingUnusableIsEverHandedToViSP) {
  const double values[] = {kNaN, kInf, -kInf, 0, -1, 1e-12, 1e300, .1, -.2, 1};
  Random random(1);
  const auto any = [&] { return values[random.integer(0, 9)]; };
  const auto focal = [&] { return random.integer(0, 1) ? kNaN : random.uniform(-800, -400); };
  FeaturePoint s;
  vpFeaturePoint s_star;
  for (int i = 0; i < 20000; ++i) {
    if (random.integer(0, 3) > 0) s.set_x(any());
    if (random.integer(0, 3) > 0) s.set_y(any());
    if (random.integer(0, 9) == 0) s.set_Z(any());
    if (random.integer(0, 9) == 0) s.setDepth(any(), any());
    if (random.integer(0, 9) == 0) s.setDesiredDepth(any());
    if (random.integer(0, 9) == 0) s.setNoise(any(), vpCameraParameters(focal(), focal(), 0, 0));
    if (random.integer(0, 999) == 0) s.init();
    vpColVector v(random.integer(0, 9) == 0 ? 5 : 6);
    for (unsigned j = 0; j < v.size(); ++j) v[j] = random.integer(0, 9) ? .1 : any();
    s.observe(v, random.integer(0, 4) ? kPeriod_s : any());

    ASSERT_TRUE(std::isfinite(s.get_x()) && std::isfinite(s.get_y())) << "call " << i;
    ASSERT_TRUE(s.get_Z() > 0 && std::isfinite(s.get_Z())) << "call " << i;
    const DepthEstimate& e = s.estimate();
    ASSERT_TRUE(std::isfinite(e.Z()) && std::isfinite(e.sigma_Z()) && e.Z() > 0) << "call " << i;
    const vpMatrix L = s.interaction();
    const vpColVector error = s.error(s_star);
    for (unsigned r = 0; r < 2; ++r) {
      ASSERT_TRUE(std::isfinite(error[r])) << "call " << i;
      // x^2 of a far-off but finite measurement may overflow; Z never adds to it.
      ASSERT_TRUE(std::isfinite(L[r][r])) << "call " << i;
    }
    if (i % 100 == 0) {
      ::testing::internal::CaptureStdout();
      s.print();
      const std::string text = ::testing::internal::GetCapturedStdout();
      ASSERT_EQ(text.find("nan"), std::string::npos) << text;
      ASSERT_EQ(text.find("inf"), std::string::npos) << text;
    }
  }
}

TEST(FeaturePoint, worksAgainAfterGarbage) {
  ObservedFeature observed(StillPoint::at(.1, .1, 1.3), kNaN);
  FeaturePoint& s = observed.feature;
  for (double bad : {kNaN, kInf, -kInf, 1e300, -1e300}) {
    s.set_x(bad);
    s.set_y(bad);
    s.set_Z(bad);
    s.observe(vpColVector(6, bad), kPeriod_s);
    s.set_x(bad);
    s.set_y(bad);
    s.observe(vpColVector(6, .1), kPeriod_s);
    s.observe(vpColVector(6, .1), bad);
  }
  observed.frames(120, kLateral);
  EXPECT_NEAR(s.estimate().Z(), 1.3, 0.03);
  EXPECT_EQ(s.estimate().status, DepthStatus::valid);
}

TEST(FeaturePoint, countsRefusedTwistsAndWidensSigmaInThatTime) {
  ObservedFeature observed(StillPoint::at(.1, .1, 1.3), 2);
  observed.frames(60, kLateral);
  FeaturePoint& s = observed.feature;
  ASSERT_EQ(s.estimate().status, DepthStatus::valid);
  unsigned refused = 0;
  double sigma = s.estimate().sigma_chi, chi = s.estimate().chi;
  EXPECT_EQ(s.refused(), refused);
  EXPECT_EQ(s.unknownFor_s(), 0);
  const vpColVector v = vispTwist(kLateral);
  const auto expectRefused = [&](const vpColVector& twist, double dt) {
    observed.measure();
    s.observe(twist, dt);
    EXPECT_EQ(s.refused(), ++refused);
    EXPECT_NEAR(s.unknownFor_s(), refused * kPeriod_s, 1e-9) << "the last good dt, if need be";
    EXPECT_EQ(s.estimate().chi, chi);
    EXPECT_GT(s.estimate().sigma_chi, sigma);
    EXPECT_EQ(s.estimate().status, DepthStatus::coasting);
    EXPECT_EQ(s.get_x(), observed.point.x()) << "the measurement still serves the servo";
    sigma = s.estimate().sigma_chi;
  };
  for (double dt : {0.0, -0.1, kNaN, kInf}) expectRefused(v, dt);
  for (unsigned size : {0u, 1u, 2u, 5u, 7u}) expectRefused(vpColVector(size, .1), kPeriod_s);
  for (unsigned j = 0; j < 6; ++j) {
    vpColVector bad = v;
    bad[j] = j % 2 ? kNaN : kInf;
    expectRefused(bad, kPeriod_s);
  }
  observed.measure();
  s.observe(Motion());
  EXPECT_EQ(s.refused(), ++refused) << "a motion without duration";
  observed.frames(60, kLateral);
  EXPECT_EQ(s.unknownFor_s(), 0);
  EXPECT_EQ(s.estimate().status, DepthStatus::valid) << "learnt again";
  EXPECT_NEAR(s.estimate().Z(), observed.point.Z(), 3 * s.estimate().sigma_Z());
}

TEST(FeaturePoint, isHonestWhileTheCameraGoesOnUnseen) {
  // Towards the point, at the bounds declared, for 0.8 s of useless twists; then known again.
  UnknownMotion bounds;
  bounds.speed_mps = .8;
  bounds.acceleration_mps2 = 1.5;
  for (const double direction : {1., -1.}) {
    ObservedFeature observed(StillPoint::at(.1, -.05, 2.5), 1);
    FeaturePoint& s = observed.feature;
    s.setUnknownMotion(bounds);
    const Twist usual{{.15, .1, 0}, {0, 0, .1}};
    observed.frames(90, usual);
    double speed = usual.linear.norm();
    for (int k = 0; k < 24; ++k) {
      speed = std::min(speed + 1.5 * kPeriod_s, .8);
      observed.point.move({{0, 0, direction * speed}, {0, 0, 0}}, kPeriod_s);
      observed.measure();
      s.observe(k % 2 ? vpColVector() : vpColVector(6, kNaN), k % 3 ? kPeriod_s : 0.);
      const DepthEstimate& e = s.estimate();
      ASSERT_EQ(e.status, DepthStatus::coasting);
      ASSERT_LT(std::abs(e.chi - observed.point.chi()), 3 * e.sigma_chi) << k;
    }
    observed.frames(90, usual);
    EXPECT_EQ(s.estimate().status, DepthStatus::valid);
    EXPECT_NEAR(s.estimate().Z() / observed.point.Z(), 1, .03);
  }
}

TEST(FeaturePoint, saysThatTheMotionIsUnknown) {
  ObservedFeature observed(StillPoint::at(.1, .1, 1.3), 2);
  FeaturePoint& s = observed.feature;
  const auto printed = [&] {
    ::testing::internal::CaptureStdout();
    s.print();
    return ::testing::internal::GetCapturedStdout();
  };
  EXPECT_EQ(printed().find("unknown"), std::string::npos);
  for (int i = 0; i < 3; ++i) s.observe(vpColVector(6, kNaN), .1);
  const std::string text = printed();
  EXPECT_NE(text.find("motion is unknown for 0.3 s: 3 twists"), std::string::npos) << text;
}

TEST(FeaturePoint, motionNobodyToldOfIsNotTakenForParallax) {
  ObservedFeature observed(StillPoint::at(.1, .1, 1.3), 2);
  observed.frames(5, kLateral);
  FeaturePoint& s = observed.feature;
  for (int i = 0; i < 20; ++i) {
    observed.frames(3, kLateral);
    observed.point.move({{.5, -.5, 0}, {.1, .2, 0}}, kPeriod_s);
    observed.measure();
    s.observe(vpColVector(6, kNaN), kPeriod_s);
    ASSERT_EQ(s.get_x(), observed.point.x()) << "the measurement still serves the servo";
    const DepthEstimate& e = s.estimate();
    ASSERT_LT(std::abs(e.chi - observed.point.chi()), std::max(.01 * e.chi, e.sigma_chi)) << i;
    ASSERT_NE(e.status, DepthStatus::rejected);
  }
}

TEST(FeaturePoint, staysWithinItsRange) {
  FeaturePoint s(NonlinearDepthObserver({}, {0.5, 2}), {0.5, 2});
  for (double guess : {0.01, 50.0}) {
    s.init();
    s.set_Z(guess);
    s.set_x(.1);
    s.set_y(.1);
    s.observe(vpColVector(6, 0.), kPeriod_s);
    EXPECT_NEAR(s.estimate().Z(), guess < 1 ? 0.5 : 2, 1e-12);
    EXPECT_EQ(s.get_Z(), .5) << "the near end of a wide interval";
  }
}

// ---- hidden and rejected ----

TEST(FeaturePoint, hiddenPointMovesToWhereItMustBe) {
  const Twist twist{{.1, -.05, .08}, {.1, .05, .2}};
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 3);
  observed.frames(90, twist);
  FeaturePoint& s = observed.feature;
  ASSERT_NEAR(s.estimate().Z() / observed.point.Z(), 1, 0.02);
  for (int i = 0; i < 30; ++i) {
    observed.hiddenFrame(twist);
    ASSERT_EQ(s.estimate().status, DepthStatus::coasting);
    ASSERT_NEAR(s.get_x(), observed.point.x(), 2 / 600.);
    ASSERT_NEAR(s.get_y(), observed.point.y(), 2 / 600.);
    ASSERT_NEAR(s.get_Z() / observed.point.Z(), 1, 0.02);
  }
  observed.frame(twist);
  EXPECT_EQ(s.estimate().status, DepthStatus::valid);
  EXPECT_EQ(s.get_x(), observed.point.x()) << "measured again: the measurement itself";
}

TEST(FeaturePoint, onlyBothCoordinatesAreAMeasurement) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 1.2);
  observed.frames(10, kLateral);
  observed.point.move(kLateral, kPeriod_s);
  observed.feature.set_x(observed.point.x());
  observed.feature.observe(vispTwist(kLateral), kPeriod_s);
  EXPECT_EQ(observed.feature.estimate().status, DepthStatus::coasting);
}

TEST(FeaturePoint, jumpIsRejectedAndThePointStaysWhereItMustBe) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 1.2);
  observed.frames(90, kLateral);
  FeaturePoint& s = observed.feature;
  observed.point.move(kLateral, kPeriod_s);
  s.set_x(observed.point.x() + .3);
  s.set_y(observed.point.y());
  s.observe(vispTwist(kLateral), kPeriod_s);
  EXPECT_EQ(s.estimate().status, DepthStatus::rejected);
  EXPECT_NEAR(s.get_x(), observed.point.x(), 1e-3);
  observed.frame(kLateral);
  EXPECT_EQ(s.estimate().status, DepthStatus::valid);
}

TEST(FeaturePoint, measurementThatIsNotFiniteIsLikeAHiddenPoint) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 1.2);
  observed.frames(90, kLateral);
  FeaturePoint& s = observed.feature;
  observed.point.move(kLateral, kPeriod_s);
  s.set_x(kNaN);
  s.set_y(kInf);
  s.observe(vispTwist(kLateral), kPeriod_s);
  EXPECT_NEAR(s.get_x(), observed.point.x(), 1e-3);
  EXPECT_NEAR(s.get_y(), observed.point.y(), 1e-3);
}

// ---- depths given by the user ----

TEST(FeaturePoint, setZBeforeTheFirstObserveIsTheGuess) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  EXPECT_NEAR(observed.feature.get_Z(), 1 / (.4 + 2 * DepthPrior::kWideSigma_chi), 1e-12)
      << "nobody vouches for it";
  EXPECT_NEAR(observed.feature.estimate().Z(), 2.5, 1e-12);
  EXPECT_EQ(observed.feature.estimate().sigma_chi, DepthPrior::kWideSigma_chi);
}

TEST(FeaturePoint, setZAfterwardsStartsTheDepthAnewThere) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  observed.frames(90, kLateral);
  ASSERT_EQ(observed.feature.estimate().status, DepthStatus::valid);
  observed.feature.set_Z(0.6);
  observed.frame(kLateral);
  EXPECT_NEAR(observed.feature.estimate().Z(), 0.6, 1e-6);
  EXPECT_EQ(observed.feature.estimate().sigma_chi, DepthPrior::kWideSigma_chi);
  observed.frames(90, kLateral);
  EXPECT_NEAR(observed.feature.estimate().Z(), 1.2, 0.03) << "and is learnt again";
}

TEST(FeaturePoint, setZWhileHiddenKeepsThePredictedPoint) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  observed.frames(90, kLateral);
  observed.feature.set_Z(0.6);
  observed.hiddenFrame(kLateral);
  EXPECT_NEAR(observed.feature.estimate().Z(), 0.6, 1e-6);
  EXPECT_NEAR(observed.feature.get_x(), observed.point.x(), 1e-3);
}

TEST(FeaturePoint, theSameDepthAtEveryImageIsNoNewDepth) {
  // The three idioms of ViSP programs that set Z with x and y.
  using Measure = std::function<void(FeaturePoint&, const StillPoint&)>;
  const Measure idioms[] = {
      [](FeaturePoint& s, const StillPoint& p) { s.buildFrom(p.x(), p.y(), 3); },
      [](FeaturePoint& s, const StillPoint& p) { s.set_xyZ(p.x(), p.y(), 3); },
      [](FeaturePoint& s, const StillPoint& p) {
        vpPoint point;
        point.set_x(p.x());
        point.set_y(p.y());
        point.set_X(3 * p.x()), point.set_Y(3 * p.y()), point.set_Z(3);
        vpFeatureBuilder::create(s, point);
      }};
  for (const Measure& measure : idioms) {
    StillPoint point = StillPoint::at(-.1, .1, 1.2);
    FeaturePoint s;
    for (int k = 0; k < 90; ++k) {
      if (k > 0) point.move(kLateral, kPeriod_s);
      if (k % 10 != 5) measure(s, point);  // hidden now and then
      s.observe(vispTwist(kLateral), kPeriod_s);
    }
    EXPECT_NEAR(s.estimate().Z(), 1.2, .03);
    EXPECT_EQ(s.estimate().status, DepthStatus::valid);
    EXPECT_EQ(s.depthsSet(), 80u);
    EXPECT_EQ(s.restarts(), 0u);
  }
}

TEST(FeaturePoint, aDepthOfTheUsersModelAtEveryImageStartsAnewOnlyWhenItJumps) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2);
  FeaturePoint& s = observed.feature;
  const auto frame = [&](double Z_model) {
    observed.point.move(kLateral, kPeriod_s);
    observed.measure();
    s.set_Z(Z_model);
    s.observe(vispTwist(kLateral), kPeriod_s);
  };
  for (int k = 0; k < 90; ++k) frame(2 + .3 * std::sin(k));
  EXPECT_NEAR(s.estimate().Z(), 1.2, .03) << "the images are believed";
  EXPECT_EQ(s.restarts(), 0u);
  EXPECT_EQ(s.depthsSet(), 90u);
  frame(.7);
  EXPECT_EQ(s.restarts(), 1u);
  EXPECT_NEAR(s.estimate().Z(), .7, 1e-6);
  ::testing::internal::CaptureStdout();
  s.print();
  const std::string text = ::testing::internal::GetCapturedStdout();
  EXPECT_NE(text.find("Z was set before 91 images"), std::string::npos) << text;
}

TEST(FeaturePoint, setDepthFusesAMeasurement) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  observed.feature.setDepth(1.2, 5e-3);
  EXPECT_NEAR(observed.feature.get_Z(), 1.2, 1e-4);
  EXPECT_NEAR(observed.feature.estimate().sigma_Z(), 5e-3, 1e-4);
  observed.feature.setDepth(1.3, 5e-3);
  EXPECT_NEAR(observed.feature.estimate().chi, .5 * (1 / 1.2 + 1 / 1.3), 1e-2);
  observed.frame(kLateral);
  EXPECT_NEAR(observed.feature.get_Z(), 1.25, 0.02) << "not taken for a set_Z";
}

TEST(FeaturePoint, setDepthThatIsUnusableOrTooEarlyIsIgnored) {
  FeaturePoint fresh;
  fresh.setDepth(2, .1);
  EXPECT_EQ(fresh.get_Z(), 1);
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  for (double bad : {kNaN, kInf, 0.0, -1.0}) {
    observed.feature.setDepth(bad, .1);
    observed.feature.setDepth(1, bad);
    EXPECT_NEAR(observed.feature.estimate().Z(), 2.5, 1e-12);
  }
}

/// The blend of the desired inverse depth (sigma 0.7 of itself) and the observed one.
double blended(const DepthEstimate& e, double Z_desired) {
  const double chi_desired = 1 / Z_desired;
  const double weight = 1 / std::pow(e.sigma_chi, 2);
  const double weight_desired = 1 / std::pow(.7 * chi_desired, 2);
  return (weight + weight_desired) / (e.chi * weight + chi_desired * weight_desired);
}

TEST(FeaturePoint, servoUsesABlendWithTheDesiredDepthWhileTheEstimateIsVague) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  FeaturePoint& s = observed.feature;
  s.setDesiredDepth(.8);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), .8, .05) << "nothing is known yet";
  EXPECT_LE(s.get_Z(), .8) << "and doubt never speeds the robot up";
  for (int i = 0; i < 90; ++i) {
    observed.frame(kLateral);
    const DepthEstimate& e = s.estimate();
    const double limit = e.isDoubtful() ? std::max(.8, e.interval().low) : 100;
    ASSERT_NEAR(s.get_Z(), std::min(blended(e, .8), limit), 1e-9);
  }
  EXPECT_NEAR(s.get_Z(), s.estimate().Z(), 0.01) << "no share of it once the depth is known";
}

TEST(FeaturePoint, depthOfTheDesiredFeatureServesTheBlendUnlessOneIsGiven) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  FeaturePoint& s = observed.feature;
  const auto used = [&](double Z_desired) {
    return std::min(blended(s.estimate(), Z_desired), Z_desired);
  };
  vpFeaturePoint s_star;
  s_star.buildFrom(0, 0, .7);
  s.error(s_star);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), used(.7), 1e-9);
  s.setDesiredDepth(.9);
  s.error(s_star);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), used(.9), 1e-9);
  for (double bad : {kNaN, kInf, 0.0, -1.0}) s.setDesiredDepth(bad);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), used(.9), 1e-9);
}

TEST(FeaturePoint, aDesiredDepthThatNobodySetIsNone) {
  ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5);
  FeaturePoint& s = observed.feature;
  vpFeaturePoint taught;  // x and y alone, as from an image
  taught.set_x(.1);
  taught.set_y(.1);
  s.error(taught);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), s.estimate().interval().low, 1e-9);
  vpFeaturePoint stated;
  stated.buildFrom(.1, .1, 1);  // the same depth, but said
  s.error(stated);
  observed.frame({});
  EXPECT_NEAR(s.get_Z(), std::min(1., blended(s.estimate(), 1)), 1e-9);
}

TEST(FeaturePoint, withoutADesiredDepthTheServoIsNoFasterThanWithTheTrueOne) {
  for (double guess : {1e-9, .01, .1, .5, 1.2, 5., 50., 1e9}) {
    ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), guess);
    FeaturePoint& s = observed.feature;
    for (int i = 0; i < 90; ++i) {
      ASSERT_LT(s.get_Z(), 1.2 * (s.estimate().isDoubtful() ? 1 : 1.5)) << guess << ", " << i;
      observed.frame(kLateral);
    }
    EXPECT_NEAR(s.get_Z(), 1.2, .03) << guess;
  }
}

/// Greatest translational speed commanded in the first two seconds of a servo; Z* by the user or
/// not.
enum class Desired { inFeature, bySetter, none };
template <class Feature>
double fastest(const vpHomogeneousMatrix& cMo_start, double Z_star, Desired desired, double guess,
               vpServo::vpServoIteractionMatrixType type) {
  vpHomogeneousMatrix cMo = cMo_start;
  Feature s[4];
  vpFeaturePoint s_star[4];
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(type);
  task.setLambda(.5);
  for (std::size_t i = 0; i < 4; ++i) {
    const vpPoint goal = FourPointScene::at(i, vpHomogeneousMatrix(0, 0, Z_star, 0, 0, 0));
    s_star[i].set_x(goal.get_x());
    s_star[i].set_y(goal.get_y());
    if (desired == Desired::inFeature) s_star[i].set_Z(goal.get_Z());
    s[i].set_Z(guess);
    if constexpr (std::is_same_v<Feature, FeaturePoint>) {
      if (desired == Desired::bySetter) s[i].setDesiredDepth(goal.get_Z());
    }
    task.addFeature(s[i], s_star[i]);
  }
  vpColVector v(6, 0.);
  double most = 0;
  for (int k = 0; k < 60; ++k) {
    for (std::size_t i = 0; i < 4; ++i) {
      const vpPoint p = FourPointScene::at(i, cMo);
      s[i].set_x(p.get_x());
      s[i].set_y(p.get_y());
      if constexpr (std::is_same_v<Feature, FeaturePoint>) {
        s[i].observe(v, kPeriod_s);
      } else {
        s[i].set_Z(guess > 0 ? guess : p.get_Z());  // 0: the truth
      }
    }
    v = task.computeControlLaw();
    most = std::max(most, std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    cMo = vpExponentialMap::direct(v, kPeriod_s).inverse() * cMo;
  }
  return most;
}

TEST(FeaturePoint, noFirstCommandIsTooFastWhateverTheGuess) {
  struct Start {
    vpHomogeneousMatrix cMo;
    double Z_star;
  };
  const Start starts[] = {{vpHomogeneousMatrix(.12, -.08, 1.2, .1, -.2, .4), .6},
                          {vpHomogeneousMatrix(-.2, .1, .5, 0, .2, -.3), .9}};
  for (const Start& start : starts) {
    const auto plain = [&](double Z) {
      return fastest<vpFeaturePoint>(start.cMo, start.Z_star, Desired::inFeature, Z,
                                     vpServo::CURRENT);
    };
    const double right = plain(0), desired = plain(start.Z_star);
    for (double guess : {1e-9, .02, .2, 1., 4., 30., 1e4, 1e9}) {
      SCOPED_TRACE(testing::Message() << "guess " << guess << ", Z* " << start.Z_star);
      for (const Desired by : {Desired::inFeature, Desired::bySetter}) {
        EXPECT_LT(fastest<FeaturePoint>(start.cMo, start.Z_star, by, guess, vpServo::CURRENT),
                  2 * std::max(right, desired));
      }
      EXPECT_LT(
          fastest<FeaturePoint>(start.cMo, start.Z_star, Desired::none, guess, vpServo::CURRENT),
          2 * right);
    }
  }
}

TEST(FeaturePoint, setNoiseWidensSigma) {
  InverseDepthFilterOptions exact;
  exact.odometry = OdometryNoise::none();
  double previous = 0;
  for (double sigma_px : {.1, .5, 2.}) {
    ObservedFeature observed(StillPoint::at(-.1, .1, 1.2), 2.5,
                             FeaturePoint(InverseDepthFilter(exact)));
    observed.feature.setNoise(sigma_px, vpCameraParameters(600, 600, 320, 240));
    observed.frames(90, kLateral);
    EXPECT_GT(observed.feature.estimate().sigma_chi, 2 * previous);
    previous = observed.feature.estimate().sigma_chi;
  }
}

TEST(FeaturePoint, defaultNoiseIsHalfAPixelAtSixHundred) {
  ObservedFeature given(StillPoint::at(-.1, .1, 1.2)), defaulted(StillPoint::at(-.1, .1, 1.2));
  given.feature.setNoise(.48, vpCameraParameters(600, 600, 320, 240));  // 8e-4
  for (double bad : {0.0, -1.0, kNaN, kInf}) {
    defaulted.feature.setNoise(bad, vpCameraParameters(600, 600, 320, 240));
  }
  given.frames(60, kLateral);
  defaulted.frames(60, kLateral);
  EXPECT_NEAR(given.feature.estimate().sigma_chi, defaulted.feature.estimate().sigma_chi, 1e-9);
}

// ---- modes of the task ----

TEST(FeaturePoint, saysWhetherTheTaskUsesItsDepth) {
  for (const auto& [type, unused] : {std::pair{vpServo::CURRENT, false},
                                     {vpServo::MEAN, false},
                                     {vpServo::DESIRED, true},
                                     {vpServo::USER_DEFINED, true}}) {
    std::vector<FeaturePoint> s(4);
    FourPointScene scene;
    std::vector<vpFeaturePoint> s_star(4);
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(type);
    task.L.resize(8, 6);
    for (unsigned i = 0; i < 6; ++i) task.L[i][i] = 1;
    for (std::size_t i = 0; i < 4; ++i) {
      vpPoint p = scene.desired(i);
      vpFeatureBuilder::create(s_star[i], p);
      task.addFeature(s[i], s_star[i]);
    }
    EXPECT_FALSE(s[0].depthUnused()) << "nothing is known before the first control";
    for (int k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        s[i].set_x(scene.seen(i).get_x());
        s[i].set_y(scene.seen(i).get_y());
        s[i].observe(vpColVector(6, 0.), kPeriod_s);
      }
      task.computeControlLaw();
      for (const FeaturePoint& f : s) EXPECT_EQ(f.depthUnused(), unused) << "type " << type;
    }
  }
}

TEST(FeaturePoint, worksWithOneCoordinateSelected) {
  FeaturePoint s;
  vpFeaturePoint s_star;
  s_star.buildFrom(0, 0, 1);
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.addFeature(s, s_star, vpFeaturePoint::selectX());
  s.set_x(.2);
  s.set_y(.1);
  s.observe(vpColVector(6, 0.), kPeriod_s);
  const vpColVector v = task.computeControlLaw();
  EXPECT_EQ(task.getError().size(), 1u);
  EXPECT_NEAR(task.getError()[0], .2, 1e-12);
  EXPECT_GT(v.frobeniusNorm(), 0);
}

TEST(FeaturePoint, observesAMotionAsItsTwist) {
  const Twist twist{{.1, -.05, .2}, {.1, .2, -.3}};
  ObservedFeature byTwist(StillPoint::at(.1, .1, 1.5)), byMotion(StillPoint::at(.1, .1, 1.5));
  for (int i = 0; i < 30; ++i) {
    byTwist.frame(twist);
    byMotion.point.move(twist, kPeriod_s);
    byMotion.measure();
    byMotion.feature.observe(Motion::fromTwist(twist, kPeriod_s));
  }
  EXPECT_EQ(byMotion.feature.estimate().chi, byTwist.feature.estimate().chi);
}

}  // namespace
}  // namespace depthservo
