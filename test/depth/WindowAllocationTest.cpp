#include <gtest/gtest.h>

#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "support/AllocationCounter.h"

namespace depthservo {
namespace {

TEST(WindowDepthEstimatorAllocations, thereAreNoneAfterConstruction) {
  for (WindowMethod method :
       {WindowMethod::leastSquares, WindowMethod::maximumLikelihood, WindowMethod::robust}) {
    WindowOptions options;
    options.method = method;
    WindowDepthEstimator estimator(options);
    double x = 0.1;
    const std::size_t before = test::allocations();
    estimator.reset({x, -.05, 1e-3}, {2});
    for (int i = 0; i < 20000; ++i) {
      const double speed = i % 2000 < 1000 ? .1 : -.1;
      estimator.predict(Motion::fromTwist({{speed, 0, 0}, {0, 0, 0}}, 1. / 30));
      x -= speed / 30 / 2;
      if (i % 100 < 90) estimator.correct({x, -.05, 1e-3});
      if (i % 1000 == 0) estimator.correctDepth({2, .1});
      if (i % 5000 == 4999) estimator.reset({x, -.05, 1e-3}, {2});
      static_cast<void>(estimator.estimate());
    }
    EXPECT_EQ(test::allocations() - before, 0u);
    EXPECT_NEAR(estimator.estimate().Z(), 2, 0.05);
  }
}

}  // namespace
}  // namespace depthservo
