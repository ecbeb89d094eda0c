#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "depthservo/depth/DepthEstimate.h"
#include "support/Random.h"

namespace depthservo::test {

/// Random inputs of an estimator that must withstand all of them; a tenth under the sanitizers.
#ifdef __SANITIZE_ADDRESS__
constexpr int kRandomInputs = 100'000;
#else
constexpr int kRandomInputs = 1'000'000;
#endif

/// A value that no caller should pass, or (three times out of four) a usual one.
inline double garbage(Random& random) {
  static const double kValues[] = {std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity(),
                                   std::numeric_limits<double>::max(),
                                   std::numeric_limits<double>::denorm_min(),
                                   0,
                                   -0.0,
                                   -1,
                                   1e-310,
                                   1e-12,
                                   1e8,
                                   1e100,
                                   -1e150,
                                   1e300};
  const int i = random.integer(0, 59);
  return i < 14 ? kValues[i] : random.uniform(-1, 1);
}

inline Twist garbageTwist(Random& random) {
  Twist twist;
  for (int i = 0; i < 3; ++i) twist.linear[i] = garbage(random);
  for (int i = 0; i < 3; ++i) twist.angular[i] = garbage(random);
  return twist;
}

inline PointMeasurement garbageMeasurement(Random& random) {
  PointMeasurement measurement;
  measurement.x = garbage(random);
  measurement.y = garbage(random);
  measurement.sigma = garbage(random);
  return measurement;
}

inline DepthPrior garbagePrior(Random& random) {
  DepthPrior prior;
  prior.Z = garbage(random);
  prior.sigma_chi = garbage(random);
  return prior;
}

/// Whether an estimate may leave: all of it finite, its depth in range.
inline ::testing::AssertionResult isSane(const DepthEstimate& e, const DepthRange& range) {
  const bool finite = std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.chi) &&
                      std::isfinite(e.sigma_chi) && std::isfinite(e.excitation) &&
                      std::isfinite(e.sigma_Z()) && std::isfinite(e.sigma_xy);
  const bool inRange = e.Z() >= range.Z_min * (1 - 1e-12) && e.Z() <= range.Z_max * (1 + 1e-12);
  if (finite && inRange && e.sigma_chi >= 0 && e.excitation >= 0) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure()
         << "x " << e.x << ", y " << e.y << ", chi " << e.chi << ", sigma_chi " << e.sigma_chi
         << ", sigma_xy " << e.sigma_xy << ", excitation " << e.excitation << ", status "
         << toString(e.status);
}

}  // namespace depthservo::test
