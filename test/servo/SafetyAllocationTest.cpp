#include <gtest/gtest.h>

#include <limits>

#include "depthservo/servo/Safety.h"
#include "support/AllocationCounter.h"

namespace depthservo::test {
namespace {

TEST(Safety, steps_do_not_allocate) {
  SafetyLimits limits;
  limits.velocity = Eigen::Vector3d(0.5, 0.5, 1);
  limits.acceleration = Eigen::Vector3d(1, 1, 2);
  limits.braking = Eigen::Vector3d(4, 4, 8);
  Safety safety(limits, {});
  safety.arm();
  const Velocities wanted[] = {Eigen::Vector3d(0.4, -0.2, 0.3), Eigen::Vector3d::Constant(1e9),
                               Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()),
                               Eigen::Vector2d(0, 0)};
  SafetyInput now;
  const std::size_t before = allocations();
  double sum = 0;
  for (int i = 0; i < 1000; ++i) {
    now.time_s += 0.02;
    now.imageAge_s = i % 100 < 10 ? 1 : 0;
    sum += safety.step(now, wanted[i / 250]).sum();
  }
  EXPECT_EQ(allocations() - before, 0u);
  EXPECT_GT(sum, 0) << "it moved";
}

}  // namespace
}  // namespace depthservo::test
