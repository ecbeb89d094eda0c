// What every DepthEstimator promises, whatever its method; a new one is added to the list below.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "support/Garbage.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::garbage;
using test::garbageMeasurement;
using test::garbagePrior;
using test::garbageTwist;
using test::isSane;
using test::Random;
using test::StillPoint;

struct Method {
  std::string name;
  std::function<std::unique_ptr<DepthEstimator>(const DepthRange&)> make;
  int inputs = test::kRandomInputs;
  bool keepsWhatItIsTold = false;  // of a depth, until its images contradict it beyond doubt
};

NonlinearDepthObserver::Options withGains(const ObserverGains& gains) {
  NonlinearDepthObserver::Options options;
  options.gains = gains;
  return options;
}

NonlinearDepthObserver::Options withOdometryNoise(double sigma_v, double sigma_w) {
  NonlinearDepthObserver::Options options;
  options.odometry = OdometryNoise::white(sigma_v, sigma_w);
  return options;
}

const std::vector<Method> kMethods{
    {"ConstantDepth",
     [](const DepthRange& range) { return std::make_unique<ConstantDepth>(range); },
     test::kRandomInputs, true},
    {"InverseDepthFilter",
     [](const DepthRange& range) {
       return std::make_unique<InverseDepthFilter>(InverseDepthFilter::Options{}, range);
     }},
    {"InverseDepthFilterWithConsideredUncertainties",
     [](const DepthRange& range) {
       InverseDepthFilter::Options options;
       options.odometryScaleSigma = 0.02;
       options.focalSigma = 0.01;
       return std::make_unique<InverseDepthFilter>(options, range);
     }},
    {"NonlinearDepthObserver",
     [](const DepthRange& range) {
       return std::make_unique<NonlinearDepthObserver>(NonlinearDepthObserver::Options{}, range);
     }},
    {"NonlinearDepthObserverWithFixedGains",
     [](const DepthRange& range) {
       return std::make_unique<NonlinearDepthObserver>(withGains({48, 44000, 0, 0}), range);
     }},
    {"NonlinearDepthObserverWithOdometryNoise",
     [](const DepthRange& range) {
       return std::make_unique<NonlinearDepthObserver>(withOdometryNoise(.005, .002), range);
     }},
    {"WindowDepthEstimator",
     [](const DepthRange& range) {
       return std::make_unique<WindowDepthEstimator>(WindowOptions{}, range);
     },
     test::kRandomInputs / 10, true},
    {"TwoFrameLeastSquares",
     [](const DepthRange& range) { return std::make_unique<TwoFrameLeastSquares>(range); },
     test::kRandomInputs, true}};

class DepthEstimatorContract : public ::testing::TestWithParam<Method> {};

INSTANTIATE_TEST_SUITE_P(Methods, DepthEstimatorContract, ::testing::ValuesIn(kMethods),
                         [](const auto& method) { return method.param.name; });

TEST_P(DepthEstimatorContract, estimateIsFiniteAndInRangeWhateverComesIn) {
  const DepthRange range;
  const auto estimator = GetParam().make(range);
  Random random(1);
  for (int i = 0; i < GetParam().inputs; ++i) {
    switch (random.integer(0, 9)) {
      case 0:
        estimator->reset(garbageMeasurement(random), garbagePrior(random));
        break;
      case 1:
        estimator->correctDepth(garbagePrior(random));
        break;
      case 2: {
        Motion motion = Motion::fromTwist(garbageTwist(random), garbage(random));
        motion.dt = garbage(random);
        estimator->predict(motion);
        break;
      }
      case 3:
      case 4:
        estimator->predict(Motion::fromTwist(garbageTwist(random), garbage(random)));
        break;
      case 5:
      case 6:
        estimator->predict(Motion::fromTwist(random.twist(.5, .5), random.uniform(.01, .1)));
        break;
      default:
        estimator->correct(garbageMeasurement(random));
    }
    ASSERT_TRUE(isSane(estimator->estimate(), range)) << "step " << i;
  }
}

TEST_P(DepthEstimatorContract, worksAgainAfterGarbage) {
  const DepthRange range;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto estimator = GetParam().make(range);
    Random random(seed);
    estimator->reset({.1, .1, 1e-3}, {2});
    for (int i = 0; i < 20; ++i) {
      estimator->predict(Motion::fromTwist(garbageTwist(random), garbage(random)));
      estimator->correct(garbageMeasurement(random));
      const DepthPrior told = garbagePrior(random);
      const bool isLie = told.isUsable() && std::abs(1 / told.Z - 1) < 0.1;  // not garbage
      if (!isLie) estimator->correctDepth(told);
    }
    // From here on all is well: measured again after the jump, and at the latest after the
    // rejections allowed in a row it follows.
    StillPoint point = StillPoint::at(-.2, .1, 1);
    const Twist twist{{.1, .03, 0}, {0, 0, 0}};
    for (int i = 0; i < 150; ++i) {
      point.move(twist, 1. / 30);
      estimator->predict(Motion::fromTwist(twist, 1. / 30));
      estimator->correct(point.measured(1e-3));
    }
    const DepthEstimate e = estimator->estimate();
    ASSERT_NEAR(e.x, point.x(), 1e-3) << "seed " << seed;
    ASSERT_NEAR(e.y, point.y(), 1e-3) << "seed " << seed;
    if (!GetParam().keepsWhatItIsTold) {
      ASSERT_NEAR(e.Z(), 1, 0.03) << "seed " << seed;
      ASSERT_EQ(e.status, DepthStatus::valid) << "seed " << seed;
    }
  }
}

TEST_P(DepthEstimatorContract, isUnsetUntilMeasured) {
  const auto estimator = GetParam().make({});
  EXPECT_EQ(estimator->estimate().status, DepthStatus::unset);
  estimator->predict(Motion::fromTwist({{.1, 0, 0}, {0, 0, 0}}, .1));
  estimator->correct({.1, .1, 1e-3});
  EXPECT_EQ(estimator->estimate().status, DepthStatus::unset);
}

TEST_P(DepthEstimatorContract, depthThatCannotBeMeantIsNotFused) {
  const auto estimator = GetParam().make({});
  estimator->reset({.1, .1, 1e-3}, {2});
  for (double Z : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    estimator->correctDepth({Z, 1e-3});
    EXPECT_EQ(estimator->estimate().Z(), 2) << Z;
  }
}

TEST_P(DepthEstimatorContract, depthHeldAtTheEndOfItsRangeIsNotCalledValid) {
  const DepthRange range{.1, 2};  // the point is at 3 m
  const auto estimator = GetParam().make(range);
  StillPoint point = StillPoint::at(-.2, .1, 3);
  estimator->reset(point.measured(1e-4), {1});
  for (int i = 0; i < 300; ++i) {
    const Twist twist{{.3 * std::cos(i / 20.), .3 * std::sin(i / 20.), 0}, {0, 0, 0}};
    point.move(twist, 1. / 30);
    estimator->predict(Motion::fromTwist(twist, 1. / 30));
    estimator->correct(point.measured(1e-4));
  }
  const DepthEstimate e = estimator->estimate();
  EXPECT_NE(e.status, DepthStatus::valid);
  if (!GetParam().keepsWhatItIsTold) {
    EXPECT_NEAR(e.Z(), range.Z_max, 1e-9);
  }
}

TEST_P(DepthEstimatorContract, resetForgetsThePast) {
  const auto used = GetParam().make({}), fresh = GetParam().make({});
  used->reset({.1, .1, 1e-3}, {2});
  for (int i = 0; i < 30; ++i) {
    used->predict(Motion::fromTwist({{.1, 0, .1}, {0, .1, 0}}, .03));
    used->correct({.1 - .003 * i, .1, 1e-3});
  }
  for (DepthEstimator* estimator : {used.get(), fresh.get()}) {
    estimator->reset({.2, -.1, 1e-3}, {3});
    for (int i = 0; i < 10; ++i) {
      estimator->predict(Motion::fromTwist({{.1, 0, 0}, {0, 0, 0}}, .03));
      estimator->correct({.2 - .001 * i, -.1, 1e-3});
    }
  }
  const DepthEstimate a = used->estimate(), b = fresh->estimate();
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.chi, b.chi);
  EXPECT_EQ(a.sigma_chi, b.sigma_chi);
  EXPECT_EQ(a.status, b.status);
}

TEST_P(DepthEstimatorContract, cloneIsIndependent) {
  const auto original = GetParam().make({});
  original->reset({.1, .1, 1e-3}, {2});
  const auto clone = original->clone();
  clone->reset({.3, .1, 1e-3}, {5});
  EXPECT_EQ(original->estimate().x, .1);
  EXPECT_EQ(original->estimate().Z(), 2);
  EXPECT_NEAR(clone->estimate().Z(), 5, 1e-12);
}

/// The same promise, with cases that shrink to a short call sequence.
RC_GTEST_PROP(NonlinearDepthObserverProperties, estimateStaysFiniteAndInRange, ()) {
  const DepthRange range;
  NonlinearDepthObserver observer({}, range);
  observer.reset({.1, -.1, 1e-3}, {1});
  const auto steps = *rc::gen::container<std::vector<std::tuple<int, int, int, int>>>(
      rc::gen::tuple(rc::gen::inRange(0, 3), rc::gen::inRange(-100, 101),
                     rc::gen::inRange(-100, 101), rc::gen::inRange(-20, 21)));
  for (const auto& [kind, a, b, exponent] : steps) {
    const double scale = std::pow(10, exponent);
    if (kind == 0) observer.predict(Motion::fromTwist({{a * scale, b * scale, 0}, {0, 0, 0}}, .03));
    if (kind == 1) observer.predict(Motion::fromTwist({{.1, 0, .1}, {.1, 0, .1}}, a * scale));
    if (kind == 2) observer.correct({.1 + a * scale, b * scale, std::abs(b) * scale});
    RC_ASSERT(isSane(observer.estimate(), range));
  }
}

}  // namespace
}  // namespace depthservo
