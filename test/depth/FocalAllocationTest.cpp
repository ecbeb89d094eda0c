#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/depth/Excitation.h"
#include "depthservo/depth/FocalLengthObserver.h"
#include "support/AllocationCounter.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

TEST(FocalAllocation, neitherTheObserverNorTheExcitationAllocatesInTheLoop) {
  constexpr double kDt = 1. / 30;
  FocalLengthObserver observer;
  Excitation excitation;
  test::StillPoint point = test::StillPoint::at(.1, -.2, 1);
  observer.reset({60, -120, .5});
  const auto measured = [&] { return CentredPixel{600 * point.x(), 600 * point.y(), .5}; };
  const std::size_t before = test::allocations();
  double sum = 0;
  for (int i = 0; i < 300; ++i) {
    const Twist twist{{.01, 0, 0}, {.3 * std::cos(i * kDt), .2 * std::sin(2 * i * kDt), 0}};
    const Motion motion = Motion::fromTwist(twist, kDt);
    observer.predict(motion);
    excitation.add(motion);
    if (i % 10 < 8) observer.correct(measured());
    if (i % 100 == 50) observer.resume(measured());
    sum += observer.estimate().focal_px + excitation.across(.1, .2);
    sum += excitation.ofDepth(.1, .2) == excitation.ofFocal(.1, .2) ? 1 : 0;
  }
  EXPECT_EQ(test::allocations() - before, 0u);
  EXPECT_GT(sum, 0);
}

}  // namespace
}  // namespace depthservo
