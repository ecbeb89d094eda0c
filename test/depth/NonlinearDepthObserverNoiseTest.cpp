// What the observer says of its own precision, against Monte Carlo with fixed seeds.
#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::Random;
using test::StillPoint;

constexpr double kSigma = 0.5 / 600;

PointMeasurement noisy(const StillPoint& point, Random& random) {
  return {point.x() + random.normal(kSigma), point.y() + random.normal(kSigma), kSigma};
}

struct SteadyState {
  double measured, reported;  // sigma of chi [1/m]
};

/// After the transient, at excitation W; sigma over 40 000 frames.
SteadyState steadyState(const ObserverGains& gains, double W, double dt) {
  NonlinearDepthObserver::Options options;
  options.gains = gains;
  NonlinearDepthObserver observer(options);
  Random random(1);
  StillPoint point = StillPoint::at(0, 0, 1);
  observer.reset(noisy(point, random), {1});
  double sum = 0, sum2 = 0, reported = 0;
  int n = 0;
  for (int i = 0; i < 42000; ++i) {
    // A straight path; lateral motion at constant Z is the same everywhere, however far it goes.
    const Twist twist{{0.6 * W, 0.8 * W, 0}, {0, 0, 0}};
    const Motion motion = Motion::fromTwist(twist, dt);
    point = StillPoint(point.cP() - twist.linear * dt);
    observer.predict(motion);
    observer.correct(noisy(point, random));
    if (i < 2000) continue;
    const double error = observer.estimate().chi - point.chi();
    sum += error;
    sum2 += error * error;
    reported += observer.estimate().sigma_chi;
    ++n;
  }
  const double mean = sum / n;
  return {std::sqrt(sum2 / n - mean * mean), reported / n};
}

TEST(NonlinearDepthObserverNoise, steadySigmaIsThatOfThePaperAtHighFrameRate) {
  // std(chi) = sigma sqrt(dt) k_3 W / sqrt(2 k): continuous time, hence k dt = 0.08 here.
  const double W = 0.1, dt = 1e-2, k = 8, k_3 = 1600;
  const double expected = kSigma * std::sqrt(dt) * k_3 * W / std::sqrt(2 * k);
  const SteadyState sigma = steadyState({k, k_3, 0, 0}, W, dt);
  EXPECT_NEAR(sigma.measured, expected, 0.06 * expected);
  EXPECT_NEAR(sigma.reported, expected, 0.06 * expected);
}

TEST(NonlinearDepthObserverNoise, reportedSteadySigmaIsTheMeasuredOne) {
  // Under-, critically and overdamped, at usual frame rates. 40 000 correlated frames leave a few
  // percent of Monte Carlo error: as many independent ones as time constants passed.
  for (const ObserverGains& gains :
       {ObserverGains{48, 44000, 0, 0}, ObserverGains{8, 1600, 0, 0}, ObserverGains{4, 4000, 0, 0},
        ObserverGains{20, 3000, 0, 0}, ObserverGains::scheduled(1.5, 0.01)}) {
    for (double dt : {1. / 30, 1. / 100}) {
      const SteadyState sigma = steadyState(gains, 0.1, dt);
      EXPECT_NEAR(sigma.reported / sigma.measured, 1, 0.06)
          << "k " << gains.k << ", k_3 " << gains.k_3 << ", dt " << dt;
    }
  }
}

TEST(NonlinearDepthObserverNoise, twoSigmaCoverTheTruthFromWideRandomGuesses) {
  // Lateral motion, guesses within 4x either way, at frames of the transient and after it.
  const int runs = 1000;
  int covered[4] = {};
  const int frames[4] = {5, 15, 30, 90};
  Random random(2);
  for (int run = 0; run < runs; ++run) {
    const double Z = random.uniform(.5, 3);
    const double angle = random.uniform(0, 6.28), speed = random.uniform(.05, .3);
    const Twist twist{{speed * std::cos(angle), speed * std::sin(angle), 0}, {0, 0, 0}};
    const double dt = 1. / 30;
    const Motion motion = Motion::fromTwist(twist, dt);
    StillPoint point = StillPoint::at(random.uniform(-.3, .3), random.uniform(-.3, .3), Z);
    NonlinearDepthObserver observer;
    observer.reset(noisy(point, random),
                   {Z * std::exp(random.uniform(std::log(.25), std::log(4.)))});
    for (int frame = 1, next = 0; frame <= 90; ++frame) {
      point = StillPoint(point.cP() - twist.linear * dt);
      observer.predict(motion);
      observer.correct(noisy(point, random));
      if (frame != frames[next]) continue;
      const DepthEstimate e = observer.estimate();
      if (std::abs(e.chi - point.chi()) <= 2 * e.sigma_chi) ++covered[next];
      ++next;
    }
  }
  for (int i = 0; i < 4; ++i) {
    RecordProperty("coverageAtFrame" + std::to_string(frames[i]), covered[i]);
    EXPECT_GE(covered[i], 0.9 * runs) << "frame " << frames[i];
  }
}

TEST(NonlinearDepthObserverNoise, reportedSigmaGrowsWithTheImageNoise) {
  double previous = 0;
  for (double sigma_px : {0.1, 0.5, 2.0}) {
    NonlinearDepthObserver observer;
    StillPoint point = StillPoint::at(0, 0, 1);
    const Twist twist{{.1, 0, 0}, {0, 0, 0}};
    const double dt = 1. / 30;
    observer.reset(point.measured(sigma_px / 600), {1});
    for (int i = 0; i < 120; ++i) {
      point = StillPoint(point.cP() - twist.linear * dt);
      observer.predict(Motion::fromTwist(twist, dt));
      observer.correct(point.measured(sigma_px / 600));
    }
    EXPECT_GT(observer.estimate().sigma_chi, 2 * previous);
    previous = observer.estimate().sigma_chi;
  }
}

}  // namespace
}  // namespace depthservo
