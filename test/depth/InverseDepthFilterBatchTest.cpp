#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "depthservo/depth/InverseDepthFilterBatch.h"
#include "support/Garbage.h"
#include "support/Trajectories.h"

namespace depthservo {
namespace {

using namespace test;
using Instructions = InverseDepthFilterBatch::Instructions;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class Batch : public ::testing::TestWithParam<Instructions> {
 protected:
  void SetUp() override {
    if (!InverseDepthFilterBatch::isSupported(GetParam())) GTEST_SKIP() << "not on this processor";
  }
};

INSTANTIATE_TEST_SUITE_P(Instructions, Batch,
                         ::testing::Values(Instructions::portable, Instructions::avx2));

void expectSame(const DepthEstimate& a, const DepthEstimate& b, std::size_t i, int k) {
  ASSERT_NEAR(a.x, b.x, 1e-12) << i << ' ' << k;
  ASSERT_NEAR(a.y, b.y, 1e-12) << i << ' ' << k;
  ASSERT_NEAR(a.chi, b.chi, 1e-12) << i << ' ' << k;
  ASSERT_NEAR(a.sigma_chi, b.sigma_chi, 1e-12) << i << ' ' << k;
  ASSERT_NEAR(a.sigma_xy, b.sigma_xy, 1e-12) << i << ' ' << k;
  ASSERT_NEAR(a.excitation, b.excitation, 1e-12) << i << ' ' << k;
  ASSERT_EQ(a.status, b.status) << i << ' ' << k;
}

TEST_P(Batch, givesWhatTheScalarFilterGivesThroughOutliersHidingAndLateStarts) {
  const Trajectory t = trajectory("T5");
  for (const double scaleSigma : {0., .02}) {
    for (const std::size_t n : {1u, 7u, 8u, 29u}) {
      InverseDepthFilter::Options options;
      options.odometryScaleSigma = scaleSigma;
      InverseDepthFilterBatch batch(n, options, {}, GetParam());
      std::vector<InverseDepthFilter> scalar(n, InverseDepthFilter(options));
      std::vector<Eigen::Vector3d> points;
      Random random(1);
      for (std::size_t i = 0; i < n; ++i) points.push_back(t.cP + random.vector(.4));
      std::vector<double> x(n), y(n), sigma(n, t.sigma());
      for (int k = 0; k < 200; ++k) {
        if (k > 0) {
          const Motion motion = Motion::fromTwist(t.twist(k - 1), t.kPeriod_s);
          batch.predict(motion);
          for (std::size_t i = 0; i < n; ++i) {
            points[i] = moved(points[i], t.twist(k - 1), t.kPeriod_s);
            scalar[i].predict(motion);
          }
        }
        for (std::size_t i = 0; i < n; ++i) {
          const Eigen::Vector3d& p = points[i];
          x[i] = p.x() / p.z() + random.normal(t.sigma());
          y[i] = p.y() / p.z() + random.normal(t.sigma());
          if (random.uniform(0, 1) < .01) y[i] += .1;
          if (random.uniform(0, 1) < .01) x[i] = kNaN;
          if (random.uniform(0, 1) < .01) y[i] = kNaN;  // not usable, rather than hidden
          if (static_cast<int>(i) == k && !std::isnan(x[i])) {
            batch.reset(i, {x[i], y[i], t.sigma()}, {1});
            scalar[i].reset({x[i], y[i], t.sigma()}, {1});
          }
          if (!std::isnan(x[i])) scalar[i].correct({x[i], y[i], t.sigma()});
        }
        batch.correct(x.data(), y.data(), sigma.data());
        if (k == 50) {
          batch.correctDepth(0, {1.5, .01});
          scalar[0].correctDepth({1.5, .01});
        }
        for (std::size_t i = 0; i < n; ++i) {
          expectSame(batch.estimate(i), scalar[i].estimate(), i, k);
          if (HasFatalFailure()) return;
        }
      }
    }
  }
}

TEST_P(Batch, pointsBehindTheCameraLeaveTheOthersAlone) {
  InverseDepthFilterBatch batch(9, {}, {}, GetParam());
  std::vector<InverseDepthFilter> scalar(9);
  std::vector<double> x(9), y(9, .1), sigma(9, 1e-3);
  const Twist ahead{{.05, 0, .3}, {0, 0, 0}};
  for (std::size_t i = 0; i < 9; ++i) {
    x[i] = .01 * static_cast<double>(i);
    batch.reset(i, {x[i], .1, 1e-3}, {i == 3 ? .2 : 2});
    scalar[i].reset({x[i], .1, 1e-3}, {i == 3 ? .2 : 2});
    if (i != 3) continue;
    batch.correctDepth(i, {.2, 1e-3});
    scalar[i].correctDepth({.2, 1e-3});
  }
  for (int k = 0; k < 40; ++k) {
    batch.predict(Motion::fromTwist(ahead, 1. / 30));
    for (InverseDepthFilter& filter : scalar) filter.predict(Motion::fromTwist(ahead, 1. / 30));
    for (std::size_t i = 0; i < 9; ++i) {
      x[i] = i == 3 && k < 35 ? kNaN : scalar[i].estimate().x;
      y[i] = scalar[i].estimate().y;
      if (!std::isnan(x[i])) scalar[i].correct({x[i], y[i], 1e-3});
    }
    batch.correct(x.data(), y.data(), sigma.data());
    for (std::size_t i = 0; i < 9; ++i) {
      expectSame(batch.estimate(i), scalar[i].estimate(), i, k);
      if (HasFatalFailure()) return;
    }
    if (k == 30) {
      EXPECT_EQ(batch.estimate(3).status, DepthStatus::lost);
    }
  }
}

TEST_P(Batch, staysFiniteWhateverComesIn) {
  InverseDepthFilterBatch batch(16, {}, {}, GetParam());
  Random random(1);
  const auto garbage = [&] { return test::garbage(random); };
  std::vector<double> x(16), y(16), sigma(16);
  for (int k = 0; k < test::kRandomInputs / 16; ++k) {
    for (std::size_t i = 0; i < 16; ++i) {
      x[i] = garbage();
      y[i] = garbage();
      sigma[i] = garbage();
      if (random.integer(0, 20) == 0)
        batch.reset(i, {x[i], y[i], sigma[i]}, {garbage(), garbage()});
    }
    batch.predict(
        Motion::fromTwist({{garbage(), garbage(), garbage()}, random.vector(1)}, garbage()));
    batch.correct(x.data(), y.data(), sigma.data());
    for (std::size_t i = 0; i < 16; ++i) {
      ASSERT_TRUE(test::isSane(batch.estimate(i), {})) << "step " << k << ", point " << i;
    }
  }
}

}  // namespace
}  // namespace depthservo
