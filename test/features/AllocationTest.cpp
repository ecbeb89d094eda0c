// Nothing in the loop may touch the heap. Counted for the whole program, C allocations included.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeatureDepth.h"
#include "depthservo/features/FeatureEllipse.h"
#include "depthservo/features/FeatureLine.h"
#include "depthservo/features/FeatureLuminance.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/features/FeaturePointPolar.h"
#include "depthservo/features/FeatureSegment.h"
#include "depthservo/visp/using.h"
#include "support/AllocationCounter.h"

namespace depthservo {
namespace {

constexpr int kIterations = 100000;
constexpr double kDt = 1. / 30;

Twist twistAt(int i) { return {{.1 * std::cos(.01 * i), .05 * std::sin(.01 * i), 0}, {0, 0, .01}}; }
PointMeasurement measurementAt(int i) {
  // Jumps and rubbish now and then: all paths count.
  const double x = i % 97 == 0 ? NAN : i % 31 == 0 ? 3. : .1 * std::cos(.001 * i);
  return {x, .1, 8e-4};
}

TEST(AllocationCounter, seesThoseOfCxxAndOfViSP) {
  const std::size_t before = test::allocations();
  ::operator delete(::operator new(8));
  const std::size_t between = test::allocations();
  { const vpColVector v(6, 0.); }
  EXPECT_GT(between, before);
  EXPECT_GT(test::allocations(), between);
}

TEST(Allocations, noneInPredictAndCorrectOfAnyEstimator) {
  std::vector<std::unique_ptr<DepthEstimator>> estimators;
  estimators.push_back(std::make_unique<InverseDepthFilter>());
  estimators.push_back(std::make_unique<InverseDepthFilter>(
      InverseDepthFilter::Options::considering(ErrorProfile::typical(), 600)));
  estimators.push_back(std::make_unique<NonlinearDepthObserver>());
  estimators.push_back(std::make_unique<ConstantDepth>());
  for (const auto& estimator : estimators) {
    double sum = 0;
    const std::size_t before = test::allocations();
    estimator->reset({.1, .1, 8e-4}, {2});
    for (int i = 0; i < kIterations; ++i) {
      estimator->predict(Motion::fromTwist(twistAt(i), i % 89 == 0 ? -1 : kDt));
      if (i % 83 == 0) estimator->predict(Motion::notKnown({kDt, .01, .01}));
      if (i % 7 != 0) estimator->correct(measurementAt(i));
      if (i % 101 == 0) estimator->correctDepth({1.5, .1});
      sum += estimator->estimate().Z();
    }
    EXPECT_EQ(test::allocations() - before, 0u);
    EXPECT_TRUE(std::isfinite(sum));
  }
}

void expectNoAllocations(PointSetEstimator& points) {
  MotionBuffer odometry(256);
  std::vector<PointObservation> seen;
  seen.reserve(5);
  const std::size_t before = test::allocations();
  for (int i = 0; i < kIterations; ++i) {
    if (i % 59 > 9) odometry.push(i * kDt, twistAt(i));  // with holes
    points.advance(odometry, i * kDt);
    seen.clear();
    for (int id = 0; id < 5; ++id) {  // one more than there is room for
      if ((i + id) % 9 != 0) seen.push_back({id, measurementAt(i + id)});
    }
    points.correct(seen);
    points.estimate(2, odometry, i * kDt + .01);
  }
  EXPECT_EQ(test::allocations() - before, 0u);
}

TEST(Allocations, noneInAdvanceAndCorrectOfASet) {
  PointwiseEstimator points(NonlinearDepthObserver(), 4);
  expectNoAllocations(points);
}

TEST(Allocations, noneInAdvanceAndCorrectOfAnObject) {
  ObjectDepthObserver object(4);
  expectNoAllocations(object);
}

TEST(Allocations, noneInObserveOfAFeature) {
  FeaturePoint s;
  vpColVector v(6, 0.), wrong(3, 0.);
  const std::size_t before = test::allocations();
  for (int i = 0; i < kIterations; ++i) {
    const PointMeasurement m = measurementAt(i);
    v[0] = twistAt(i).linear.x();
    if (i % 7 != 0) {
      s.set_x(m.x);
      s.set_y(m.y);
    }
    if (i % 1009 == 0) s.set_Z(i % 2 ? 2. : NAN);
    if (i % 211 == 0) s.setDepth(1.5, .1);
    s.observe(i % 501 == 0 ? wrong : v, kDt);
  }
  EXPECT_EQ(test::allocations() - before, 0u);
}

/// \param set what the image shows, by one number; rubbish now and then
template <typename Feature, typename Set>
void expectNoAllocations(Feature& s, int iterations, const Set& set) {
  vpColVector v(6, 0.), wrong(3, 0.);
  const std::size_t before = test::allocations();
  for (int i = 0; i < iterations; ++i) {
    v[0] = twistAt(i).linear.x();
    if (i % 7 != 0) set(s, measurementAt(i).x);
    s.observe(i % 501 == 0 ? wrong : v, kDt);
  }
  EXPECT_EQ(test::allocations() - before, 0u);
}

TEST(Allocations, noneInObserveOfTheOtherFeatures) {
  constexpr int kFewer = 20000;
  FeaturePointPolar polar;
  expectNoAllocations(polar, kFewer, [](auto& s, double x) { s.set_rho(x), s.set_theta(.1); });
  FeatureDepth depth;
  depth.setDesiredDepth(1);
  expectNoAllocations(depth, kFewer, [](auto& s, double x) { s.set_x(x), s.set_y(.1); });
  FeatureSegment segment;
  segment.buildFrom(.1, .1, 1, -.1, .1, 1);
  expectNoAllocations(segment, kFewer, [](auto& s, double x) {
    s.setXc(x), s.setYc(.1), s.setL(.2), s.setAlpha(.3);
  });
  FeatureLine line;
  expectNoAllocations(line, kFewer, [](auto& s, double x) { s.setRhoTheta(x, .4); });
  for (const EllipseShape shape : {EllipseShape::planar, EllipseShape::sphere}) {
    FeatureEllipse ellipse(shape);
    expectNoAllocations(ellipse, kFewer,
                        [](auto& s, double x) { s.buildFrom(x, .1, .01, .001, .02); });
  }
}

TEST(Allocations, noneInObserveOfLuminance) {
  vpImage<unsigned char> image(40, 50);
  vpCameraParameters cam(100, 100, 25, 20);
  FeatureLuminance s;
  s.init(40, 50, 1);
  s.setCameraParameters(cam);
  expectNoAllocations(s, 500, [&](auto& f, double x) {
    for (unsigned i = 0; i < image.getSize(); ++i) {
      image.bitmap[i] = static_cast<unsigned char>(100 + 50 * std::sin(.2 * (i % 50) + 20 * x));
    }
    f.buildFrom(image);
  });
}

TEST(Allocations, noneInObserveOfAGroup) {
  FeaturePointGroup s(PointwiseEstimator(NonlinearDepthObserver(), 4), 4);
  vpColVector v(6, 0.);
  const std::size_t before = test::allocations();
  for (int i = 0; i < kIterations; ++i) {
    v[0] = twistAt(i).linear.x();
    for (int j = 0; j < 4; ++j) {
      const PointMeasurement m = measurementAt(i + j);
      if ((i + j) % 7 == 0) continue;
      s[static_cast<std::size_t>(j)].set_x(m.x);
      s[static_cast<std::size_t>(j)].set_y(m.y);
    }
    s.observe(v, i % 301 == 0 ? -1 : kDt);
  }
  EXPECT_EQ(test::allocations() - before, 0u);
}

TEST(Allocations, noneInUpdateOfMoments) {
  FeaturePointGroup points(ObjectDepthObserver(4), 4);
  FeatureMoments s;
  double sum = 0;
  const std::size_t before = test::allocations();
  for (int i = 0; i < kIterations; ++i) {
    for (int j = 0; j < 4; ++j) points[static_cast<std::size_t>(j)].set_x(measurementAt(i + j).x);
    s.update(points);
    sum += s.get_size();
  }
  EXPECT_EQ(test::allocations() - before, 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(Allocations, interactionOfMomentsMakesNoMoreThanItsMatrix) {
  FeatureMoments s;
  const std::size_t before = test::allocations();
  s.interaction();
  const std::size_t ours = test::allocations() - before;
  vpMatrix(3, 6);
  EXPECT_LE(ours, test::allocations() - before - ours);
}

TEST(Allocations, interactionMakesNoMoreThanTheBaseClass) {
  vpFeaturePoint plain;
  FeaturePoint ours;
  const auto count = [](vpFeaturePoint& s) {
    s.buildFrom(.1, .2, 1);
    const std::size_t before = test::allocations();
    s.interaction();
    return test::allocations() - before;
  };
  count(plain);
  EXPECT_LE(count(ours), count(plain));
}

}  // namespace
}  // namespace depthservo
