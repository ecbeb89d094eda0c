#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <vector>

#include "depthservo/depth/FocalLengthObserver.h"
#include "support/Garbage.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::garbage;
using test::Random;
using test::StillPoint;

constexpr double kDt = 1.0 / 30;
constexpr double kInf = std::numeric_limits<double>::infinity();

using TwistAt = std::function<Twist(double)>;

Twist turning(double wx, double wy, double wz = 0) { return {{0, 0, 0}, {wx, wy, wz}}; }

/// Two axes out of step: what tells a focal length best.
TwistAt nodding(double turnRate) {
  return [turnRate](double t) {
    return turning(turnRate * std::cos(2 * t), turnRate * std::sin(3 * t));
  };
}

/// A point, a camera of known focal length, and its observer.
struct Camera {
  Camera(double focal_px, double y1, double y2, const FocalLengthObserver::Options& options,
         double guess_px = 0, double Z = 1)
      : focal(focal_px), point(StillPoint::at(y1 / focal, y2 / focal, Z)), observer(options) {
    observer.reset(measured(), guess_px);
  }

  CentredPixel measured(double sigma = 0) const {
    return {focal * point.x(), focal * point.y(), sigma};
  }
  void move(const TwistAt& twistAt, double dt = kDt) {
    point.move(twistAt, time_s, time_s + dt);
    observer.predict(Motion::fromTwist(twistAt(time_s + dt / 2), dt));
    time_s += dt;
  }
  void frames(double duration_s, const TwistAt& twistAt, double dt = kDt) {
    for (int i = 0; i < std::lround(duration_s / dt); ++i) {
      move(twistAt, dt);
      observer.correct(measured());
    }
  }
  FocalEstimate estimate() const { return observer.estimate(); }
  DepthStatus status() const { return estimate().status; }

  double focal;
  StillPoint point;
  FocalLengthObserver observer;
  double time_s = 0;
};

FocalLengthObserver::Options withGains(const FocalGains& gains) {
  FocalLengthObserver::Options options;
  options.gains = gains;
  return options;
}

FocalLengthObserver::Options settlingIn(double settling_s, double turnRate, double radius_px) {
  return withGains(FocalGains::fromSettlingTime(settling_s, turnRate, radius_px));
}

// ---- convergence ----

TEST(FocalLengthObserver, findsAnyFocalLengthFromNothing) {
  for (double focal_px : {128., 600., 3000.}) {
    Camera camera(focal_px, .15 * focal_px, -.2 * focal_px, settlingIn(2, .3, .25 * focal_px));
    camera.frames(12, nodding(.3));
    EXPECT_NEAR(camera.estimate().focal_px, focal_px, 0.01 * focal_px);
    EXPECT_NEAR(camera.estimate().consistency(), 1, 0.02) << "1/lambda agrees";
    EXPECT_EQ(camera.status(), DepthStatus::valid);
  }
}

TEST(FocalLengthObserver, goodGuessIsKept) {
  Camera camera(600, 100, -120, settlingIn(2, .3, 150), 600);
  for (int i = 0; i < 100; ++i) {
    camera.frames(kDt, nodding(.3));
    ASSERT_NEAR(camera.estimate().focal_px, 600, 0.5);
  }
}

/// The paper's observer as a differential equation, by Runge-Kutta at 20 kHz.
double focalByDifferentialEquation(const Camera& camera, const TwistAt& twistAt, FocalGains k,
                                   double guess_px, double duration_s) {
  using Vector4 = Eigen::Vector4d;
  StillPoint point = camera.point;
  Vector4 h(camera.focal * point.x(), camera.focal * point.y(), guess_px, 1 / guess_px);
  const double dt = 1. / 20000;
  for (int i = 0; i < std::lround(duration_s / dt); ++i) {
    const double t = i * dt;
    const Eigen::Vector3d w = twistAt(t).angular;
    const double y1 = camera.focal * point.x(), y2 = camera.focal * point.y();
    const double q = y2 * w.x() - y1 * w.y();
    const double e1 = y1 - h[0], e2 = y2 - h[1];
    h += dt * Vector4(-w.y() * h[2] + q * y1 * h[3] + y2 * w.z() + k.k * e1,
                      w.x() * h[2] + q * y2 * h[3] - y1 * w.z() + k.k * e2,
                      k.k_3 * (-w.y() * e1 + w.x() * e2), k.k_4 * q * (y1 * e1 + y2 * e2));
    point.move(twistAt, t, t + dt);
  }
  return h[2];
}

TEST(FocalLengthObserver, followsTheDifferentialEquationOfThePaper) {
  const FocalGains gains{50, 500, 1e-4};
  const TwistAt twistAt = [](double t) {
    return turning(.5 * std::cos(M_PI * t / 2), .3 * std::sin(M_PI * t), .2);
  };
  for (double guess_px : {60., 100., 200.}) {
    for (double duration_s : {.5, 1.5, 3.}) {
      Camera camera(128, 10, -10, withGains(gains), guess_px);
      const double expected_px =
          focalByDifferentialEquation(camera, twistAt, gains, guess_px, duration_s);
      camera.frames(duration_s, twistAt, 1e-3);
      EXPECT_NEAR(camera.estimate().focal_px, expected_px, 0.005 * std::abs(guess_px - 128))
          << guess_px << " px, " << duration_s << " s";
    }
  }
}

TEST(FocalLengthObserver, errorOfThePointDecaysAsWithoutSamplingAtAnyFrameRate) {
  for (double dt : {1e-3, 1. / 30, .2}) {
    Camera camera(300, 60, -50, withGains({20, 100, 1e-6}), 300);
    camera.observer.reset({64, -50, 0}, 300);
    const int frames = std::max(1, static_cast<int>(std::lround(.1 / dt)));
    camera.frames(
        frames * dt, [](double) { return turning(0, 0, .1); }, dt);
    const CentredPixel truth = camera.measured();
    const double left_px =
        std::hypot(camera.estimate().y1 - truth.y1, camera.estimate().y2 - truth.y2);
    EXPECT_NEAR(left_px, 4 * std::exp(-20 * frames * dt), 1e-6) << dt;
  }
}

TEST(FocalLengthObserver, isStableWithAnyGainsAtAnyFrameRate) {
  for (double dt : {1. / 100, 1. / 30, 1. / 5}) {
    for (const FocalGains& gains :
         {FocalGains{50, 5000, 1}, {30, 1500, .01}, {200, 1e6, 1e3}, {5, 1, 1e-9}}) {
      Camera camera(600, 90, 120, withGains(gains), 300);
      for (int i = 0; i < 200; ++i) {
        camera.frames(dt, nodding(.4), dt);
        ASSERT_LT(std::abs(camera.estimate().focal_px - 600), 700) << gains.k_3 << ", " << dt;
      }
      if (gains.k_3 > 1) {
        EXPECT_NEAR(camera.estimate().focal_px, 600, 20) << gains.k_3 << ", " << dt;
      }
    }
  }
}

TEST(FocalLengthObserver, leverArmBiasesByOnePlusLeverOverDepthAndIsCompensated) {
  const double lever_m = 0.07;
  for (double Z : {1., 2., 4., 20.}) {
    const TwistAt onUnicycle = [&](double t) {
      const double turn = 6 * M_PI / 180 * std::cos(M_PI * t / 4);
      return Twist{{-lever_m * turn, 0, -.02 * turn}, {0, -turn, 0}};
    };
    Camera camera(1096, 17, 132.99, withGains({30, 1500, .01}), 0, Z);
    camera.frames(60, onUnicycle);
    EXPECT_NEAR(camera.estimate().focal_px, 1096 * (1 + lever_m / Z), 1);
    EXPECT_NEAR(compensatedFocal(camera.estimate().focal_px, lever_m, Z), 1096, 1);
  }
}

TEST(FocalLengthObserver, sigmaCoversTheErrorUnderImageNoise) {
  int covered = 0, runs = 0;
  double squares = 0, sigma2 = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    Camera camera(600, 90, -120, settlingIn(3, .3, 150));
    for (int i = 0; i < 900; ++i) {
      camera.move(nodding(.3));
      CentredPixel y = camera.measured(.5);
      y.y1 += random.normal(.5);
      y.y2 += random.normal(.5);
      camera.observer.correct(y);
    }
    const FocalEstimate e = camera.estimate();
    covered += std::abs(e.focal_px - 600) < 2 * e.sigma_focal_px;
    squares += (e.focal_px - 600) * (e.focal_px - 600);
    sigma2 += e.sigma_focal_px * e.sigma_focal_px;
    ++runs;
  }
  EXPECT_GE(covered, 34) << "2 sigma of 40 runs: 38 expected, 34 at the 2 % limit";
  EXPECT_NEAR(std::sqrt(squares / sigma2), 1, 0.35) << std::sqrt(sigma2 / runs) << " px declared";
}

// ---- excitation ----

TEST(FocalLengthObserver, rotationAboutTheOpticalAxisTellsNothing) {
  Camera camera(600, 90, 120, settlingIn(2, .3, 150), 400);
  for (int i = 0; i < 200; ++i) {
    camera.frames(kDt, [](double) { return turning(0, 0, .5); });
    ASSERT_EQ(camera.status(), DepthStatus::unexcited);
    ASSERT_NEAR(camera.estimate().focal_px, 400, 1e-6);
  }
  EXPECT_NEAR(camera.estimate().sigma_min, 0, 1e-12);
  EXPECT_NEAR(camera.estimate().eta1, 0, 1e-9);
  EXPECT_NEAR(camera.estimate().eta2, 0, 1e-9);
}

TEST(FocalLengthObserver, cameraAtRestKeepsFocalLengthAndSigma) {
  Camera camera(600, 90, 120, settlingIn(2, .3, 150), 400);
  const double sigma = camera.estimate().sigma_focal_px;
  camera.frames(3, [](double) { return turning(0, 0); });
  EXPECT_EQ(camera.status(), DepthStatus::unexcited);
  EXPECT_EQ(camera.estimate().focal_px, 400);
  EXPECT_EQ(camera.estimate().sigma_focal_px, sigma);
}

TEST(FocalLengthObserver, pointNearTheCentreTellsLambdaButNotItsInverse) {
  // c = 0 in the middle of the image: 1/lambda has no part in how the point moves.
  Camera camera(600, 0, 0, settlingIn(1, .02, 150), 400);
  camera.frames(6, nodding(.02));
  EXPECT_NEAR(camera.estimate().focal_px, 600, 6);
  EXPECT_NEAR(camera.estimate().inverseFocal, 1. / 400, 1e-4);
  EXPECT_NE(camera.status(), DepthStatus::unexcited);
  EXPECT_NE(camera.status(), DepthStatus::valid) << "the two do not agree";
}

TEST(FocalLengthObserver, etasAndTheGramianAreThoseOfTheMotion) {
  FocalLengthObserver::Options options = settlingIn(2, .3, 150);
  options.window_s = .7;
  Camera camera(600, 90, -120, options, 600);
  Eigen::Matrix2d gramian = Eigen::Matrix2d::Zero();
  const double dt = 1e-3;
  for (int i = 0; i < 2000; ++i) {
    const double t = camera.time_s;
    camera.frames(dt, nodding(.3), dt);
    const Eigen::Vector3d w = nodding(.3)(t + dt / 2).angular;
    const CentredPixel y = camera.measured();
    const double eta1 = y.y1 * w.x() + y.y2 * w.y(), eta2 = y.y2 * w.x() - y.y1 * w.y();
    ASSERT_NEAR(camera.estimate().eta1, eta1, .1);
    ASSERT_NEAR(camera.estimate().eta2, eta2, .1);
    Eigen::Matrix2d Omega;
    Omega << -w.y(), w.x(), y.y1 * eta2, y.y2 * eta2;
    EXPECT_NEAR(Omega.determinant(), -eta1 * eta2, 1e-9 * (1 + std::abs(eta1 * eta2)));
    gramian = std::exp(-dt / .7) * gramian + Omega * Omega.transpose() * dt;
  }
  const double expected = gramian.selfadjointView<Eigen::Upper>().eigenvalues().minCoeff();
  EXPECT_NEAR(camera.estimate().sigma_min, expected, .02 * expected);
}

// ---- hidden, rejected, unusable ----

TEST(FocalLengthObserver, coastsWhileHiddenAndGoesOnAfterwards) {
  Camera camera(600, 90, -120, settlingIn(2, .3, 150));
  camera.frames(8, nodding(.3));
  ASSERT_EQ(camera.status(), DepthStatus::valid);
  for (int i = 0; i < 30; ++i) {
    camera.move(nodding(.3));
    ASSERT_EQ(camera.status(), DepthStatus::coasting);
    ASSERT_NEAR(camera.estimate().y1, camera.measured().y1, 1) << "predicted by the rotation";
  }
  camera.observer.correct(camera.measured());
  EXPECT_EQ(camera.status(), DepthStatus::valid);
  EXPECT_NEAR(camera.estimate().focal_px, 600, 6);
}

TEST(FocalLengthObserver, estimateDoesNotDependOnHowTheMotionIsCut) {
  Camera whole(600, 90, -120, settlingIn(2, .3, 150)), cut = whole;
  const TwistAt steady = [](double) { return turning(.2, -.15, .1); };
  for (int i = 0; i < 40; ++i) {
    whole.frames(kDt, steady);
    cut.move(steady, .3 * kDt);
    cut.move(steady, .5 * kDt);
    cut.frames(.2 * kDt, steady, .2 * kDt);
  }
  EXPECT_NEAR(cut.estimate().focal_px, whole.estimate().focal_px, 1e-6);
  EXPECT_NEAR(cut.estimate().sigma_focal_px, whole.estimate().sigma_focal_px, 1e-6);
}

TEST(FocalLengthObserver, jumpIsRejectedFiveTimesThenBelieved) {
  Camera camera(600, 90, -120, settlingIn(2, .3, 150));
  camera.frames(10, nodding(.3));
  const double focal_px = camera.estimate().focal_px;
  for (int i = 0; i < 6; ++i) {
    camera.move(nodding(.3));
    CentredPixel wrong = camera.measured();
    wrong.y1 += 100;
    camera.observer.correct(wrong);
    if (i < 5) {
      ASSERT_EQ(camera.status(), DepthStatus::rejected) << i;
    }
  }
  EXPECT_NE(camera.status(), DepthStatus::rejected);
  EXPECT_NEAR(camera.estimate().focal_px, focal_px, 1) << "the focal length at hand is kept";
}

TEST(FocalLengthObserver, pointThatTurnsBehindTheCameraIsLostUntilItIsSeenAgain) {
  Camera camera(600, 90, -120, settlingIn(2, .3, 150), 600);
  camera.observer.predict(Motion::fromTwist(turning(0, 3), 1));
  EXPECT_EQ(camera.status(), DepthStatus::lost);
  camera.observer.correct({10, 10, 0});
  EXPECT_NE(camera.status(), DepthStatus::lost);
  EXPECT_EQ(camera.estimate().focal_px, 600);
}

TEST(FocalLengthObserver, isUnsetUntilAUsableMeasurement) {
  FocalLengthObserver observer;
  observer.predict(Motion::fromTwist(turning(.1, 0), kDt));
  observer.correct({1, 2, .5});
  EXPECT_EQ(observer.estimate().status, DepthStatus::unset);
  observer.reset({std::nan(""), 0, 0});
  EXPECT_EQ(observer.estimate().status, DepthStatus::unset);
  observer.reset({1, 2, .5}, std::nan(""));
  EXPECT_NE(observer.estimate().status, DepthStatus::unset);
  EXPECT_EQ(observer.estimate().focal_px, 0) << "an unusable guess is no guess";
}

TEST(FocalLengthObserver, estimateIsFiniteAndInRangeWhateverComesIn) {
  Random random(1);
  FocalLengthObserver observer;
  const FocalRange range;
  for (int i = 0; i < test::kRandomInputs; ++i) {
    const auto pixel = [&] {
      return CentredPixel{300 * garbage(random), 300 * garbage(random), std::abs(garbage(random))};
    };
    switch (random.integer(0, 19)) {
      case 0:
        observer.reset(pixel(), 500 * garbage(random));
        break;
      case 1:
        observer.predict(Motion::fromTwist(test::garbageTwist(random), garbage(random)));
        break;
      case 2:
      case 3:
        observer.correct(pixel());
        break;
      default:
        observer.predict(Motion::fromTwist(random.twist(1, 1), kDt));
        observer.correct({random.uniform(-300, 300), random.uniform(-300, 300), .5});
    }
    const FocalEstimate e = observer.estimate();
    ASSERT_TRUE(
        std::isfinite(e.y1 + e.y2 + e.eta1 + e.eta2 + e.sigma_min + e.decayRate + e.sigma_focal_px))
        << i;
    ASSERT_TRUE(e.focal_px >= 0 && e.focal_px <= range.largest_px) << i << ": " << e.focal_px;
    ASSERT_TRUE(e.inverseFocal >= 0 && e.inverseFocal <= 1 / range.smallest_px) << i;
  }
}

RC_GTEST_PROP(FocalLengthObserverProperty, errorNeverGrowsWithoutNoise, ()) {
  // The Lyapunov function of the paper, |e_y|^2 + e_3^2/k_3 + e_4^2/k_4, at the end of a run.
  const auto seed = *rc::gen::inRange(0u, 1000000u);
  Random random(seed);
  const double focal_px = random.uniform(100, 2000), guess_px = focal_px * random.uniform(.3, 3);
  const double turnRate = random.uniform(.05, .6);
  FocalLengthObserver::Options options = settlingIn(random.uniform(.5, 5), turnRate, .2 * focal_px);
  options.gate_px = 1e5;
  Camera camera(focal_px, focal_px * random.uniform(-.2, .2), focal_px * random.uniform(-.2, .2),
                options, guess_px);
  const FocalGains& k = options.gains;
  const auto energy = [&] {
    const FocalEstimate e = camera.estimate();
    const CentredPixel y = camera.measured();
    return std::pow(e.y1 - y.y1, 2) + std::pow(e.y2 - y.y2, 2) +
           std::pow(e.focal_px - focal_px, 2) / k.k_3 +
           std::pow(e.inverseFocal - 1 / focal_px, 2) / k.k_4;
  };
  const double before = energy();
  camera.frames(4, nodding(turnRate));
  RC_ASSERT(energy() < 1.02 * before);
}

}  // namespace
}  // namespace depthservo
