// The observer as printed: its right side against a point that moves, and what it does at two
// rates.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "depth/EulerObserver.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

const Twist kTwist{{0.3, -0.1, 0.2}, {0.1, -0.2, 0.3}};
const ObserverGains kGains{10, 300};

Eigen::Vector3d stateOf(const test::StillPoint& point) {
  return {point.x(), point.y(), 1 / point.Z()};
}

TEST(EulerObserver, rate_of_the_true_state_is_that_of_the_point) {
  constexpr double h = 1e-5;
  test::StillPoint point = test::StillPoint::at(0.2, -0.3, 1.25);
  const Eigen::Vector3d before = stateOf(point);
  point.move(kTwist, h);
  const Eigen::Vector3d expected = (stateOf(point) - before) / h;
  const Eigen::Vector3d rate = EulerObserver::rate(kGains, kTwist, before.head<2>(), before);
  EXPECT_LT((rate - expected).norm(), 1e-4);
}

TEST(EulerObserver, errors_in_the_image_pull_by_the_gains) {
  const Eigen::Vector2d measured(0.2, -0.3), e(0.01, 0.02);
  const Eigen::Vector3d estimate(measured.x() - e.x(), measured.y() - e.y(), 0.8);
  const Eigen::Vector3d with = EulerObserver::rate(kGains, kTwist, measured, estimate);
  const Eigen::Vector3d without = EulerObserver::rate({0, 0}, kTwist, measured, estimate);
  const Eigen::Vector2d Omega(-0.3 + 0.2 * 0.2, 0.1 - 0.3 * 0.2);
  EXPECT_NEAR(with.x() - without.x(), 10 * e.x(), 1e-12);
  EXPECT_NEAR(with.y() - without.y(), 10 * e.y(), 1e-12);
  EXPECT_NEAR(with.z() - without.z(), 300 * Omega.dot(e), 1e-12);
}

/// Largest of the depth in the last half of this time, before a camera that goes to and fro
/// sideways, 1 m from the point.
double lateError(double duration_s, double rate, DepthEstimator& observer) {
  test::StillPoint point = test::StillPoint::at(0.1, 0, 1);
  observer.reset({point.x(), point.y(), 1e-3}, {3});
  double largest = 0;
  for (int k = 0; k < duration_s * rate; ++k) {
    const Twist twist{{0.3 * std::cos(2 * k / rate), 0, 0}, {0, 0, 0}};
    point.move(twist, 1 / rate);
    observer.predict(Motion::fromTwist(twist, 1 / rate));
    observer.correct({point.x(), point.y(), 1e-3});
    const double error = std::abs(observer.estimate().Z() / point.Z() - 1);
    if (2 * k > duration_s * rate) largest = std::max(largest, error);
  }
  const DepthEstimate estimate = observer.estimate();
  EXPECT_EQ(estimate.x, point.x());
  EXPECT_EQ(estimate.y, point.y());
  EXPECT_EQ(estimate.status, DepthStatus::converging);
  EXPECT_GT(estimate.chi, 0);
  return largest;
}

TEST(EulerObserver, converges_at_a_high_rate_and_not_at_one_that_is_too_low) {
  EulerObserver observer(kGains, {0.1, 100});
  const auto other = observer.clone();
  EXPECT_LT(lateError(20, 1000, observer), 0.01);
  EXPECT_GT(lateError(20, 3, *other), 0.1) << "10 / s at 3 Hz is unstable";
}

TEST(EulerObserver, ignores_motion_that_is_not_finite) {
  EulerObserver observer(kGains, {0.1, 100});
  observer.reset({0.1, 0, 1e-3}, {3});
  observer.correctDepth({1});
  Motion motion = Motion::fromTwist(kTwist, 0.1);
  motion.t.x() = std::nan("");
  observer.predict(motion);
  EXPECT_DOUBLE_EQ(observer.estimate().Z(), 3) << "nor does it take depths";
}

}  // namespace
}  // namespace depthservo
