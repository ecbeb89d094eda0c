// Whether depths are honest on a robot with everyday errors, which RobotExperiment simulates on its
// own.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/RobotExperiment.h"

namespace depthservo {
namespace {

using test::Honesty;
using test::Random;
using test::Robot;
using test::RobotErrors;
using test::RobotRun;

constexpr std::size_t kPoints = Robot::kPoints;
constexpr int kRobots = 24;

std::unique_ptr<PointSetEstimator> joint() {
  return std::make_unique<SharedErrorFilter>(kPoints, SharedErrorFilterOptions{}, DepthPrior{3});
}

std::unique_ptr<PointSetEstimator> alone() {
  const SharedErrorFilter one(1, {}, DepthPrior{3});
  return std::make_unique<SeparatePoints>(one, kPoints, DepthPrior{3});
}

Robot typical(unsigned seed) { return Robot::typical(seed); }
Robot slipping(unsigned seed) { return Robot::slipping(seed, .05); }

Honesty meanOf(const std::function<std::unique_ptr<PointSetEstimator>()>& make,
               double* worstError = nullptr, Robot (*draw)(unsigned) = typical) {
  Honesty mean;
  for (unsigned seed = 0; seed < kRobots; ++seed) {
    const auto estimator = make();
    const Honesty one = draw(seed).judge(*estimator);
    mean.coverage += one.coverage / kRobots;
    mean.valid += one.valid / kRobots;
    mean.scaled += one.scaled / kRobots;
    if (worstError) *worstError = std::max(*worstError, one.scaled);
  }
  return mean;
}

TEST(RobotErrors, leaveJointDepthsHonestAndPrecise) {
  double worst = 0;
  const Honesty mean = meanOf(joint, &worst);
  EXPECT_GE(mean.coverage, 0.93);
  EXPECT_GE(mean.valid, 0.7);
  EXPECT_LE(mean.scaled, 0.008);
  EXPECT_LE(worst, 0.04);
}

TEST(RobotErrors, leaveDepthsOfPointsAloneHonest) {
  const Honesty mean = meanOf(alone);
  EXPECT_GE(mean.coverage, 0.90);
  EXPECT_GE(mean.valid, 0.6);
}

TEST(RobotErrors, ofSlipBeyondTheProfileLeaveJointDepthsHonest) {
  const auto trusting = [] {
    SharedErrorFilterOptions options;
    options.isCautious = false;
    return std::make_unique<SharedErrorFilter>(kPoints, options, DepthPrior{3});
  };
  const Honesty mean = meanOf(joint, nullptr, slipping);
  EXPECT_GE(mean.coverage, 0.9);
  EXPECT_GE(mean.valid, 0.7);
  EXPECT_LT(meanOf(trusting, nullptr, slipping).coverage, 0.87);
}

TEST(RobotErrors, thatAreNotThereLeaveDepthsExact) {
  Robot robot(2, RobotErrors{});
  const auto estimator = joint();
  const Honesty honesty = robot.judge(*estimator);
  EXPECT_GE(honesty.coverage, 0.95);
  EXPECT_LE(honesty.scaled, 0.005);
}

TEST(RobotErrors, ofWhiteNoiseAloneAreFarTooSmall) {  // so that the tests above can fail
  const auto white = std::make_unique<SharedErrorFilter>(
      kPoints,
      [] {
        SharedErrorFilterOptions options;
        options.errors = ErrorProfile{};
        options.errors.odometry = OdometryNoise();
        return options;
      }(),
      DepthPrior{3});
  EXPECT_LT(Robot::typical(2).judge(*white).coverage, 0.5);
}

TEST(RobotErrors, areLearntWithAnHonestSigma) {
  double sum[3] = {};
  for (unsigned seed = 0; seed < kRobots; ++seed) {
    const Robot robot = Robot::ofPrior(seed);
    SharedErrorFilter filter(kPoints, {}, DepthPrior{3});
    robot.judge(filter);
    const auto nees = [](const SharedErrorFilter::Shared& state, double truth) {
      EXPECT_LT(state.sigma, 0.5 * state.prior);
      return std::pow((state.value - truth) / state.sigma, 2) / kRobots;
    };
    sum[0] += nees(filter.latency(), robot.errors.latency_s);
    sum[1] += nees(filter.gyroBias(1), robot.errors.bias(1));
    sum[2] += nees(filter.mount(1), robot.errors.mount(1));
  }
  for (const double nees : sum) {
    EXPECT_GT(nees, 0.5);
    EXPECT_LT(nees, 2.2);
  }
}

TEST(RobotErrors, ofManyPointsAreLearntFromAFew) {
  Robot robot = Robot::typical(4);
  SharedErrorFilterOptions few;
  few.places = 5;
  SharedErrorFilter filter(kPoints, few, DepthPrior{3});
  const Honesty honesty = robot.judge(filter);
  EXPECT_GE(honesty.coverage, 0.9);
  EXPECT_GE(honesty.valid, 0.7);
  EXPECT_LE(honesty.scaled, 0.02);
}

TEST(SharedErrorFilter, knowsARollingShutter) {
  RobotErrors errors;
  errors.readout_s = 0.03;
  const Robot robot(3, errors);
  SharedErrorFilterOptions options;
  options.errors = ErrorProfile{};
  options.errors.odometry = OdometryNoise::white(1e-4, 1e-4);
  const auto error = [&] {
    SharedErrorFilter filter(kPoints, options, DepthPrior{3});
    return robot.judge(filter).error;
  };
  const double unknown = error();
  options.errors.readout_s = errors.readout_s;
  options.rowScale = 1.25;
  options.rowOffset = 0.5;
  EXPECT_LT(error(), 0.3 * unknown);
}

TEST(SharedErrorFilter, learnsTheScaleFromADepthThatIsMeasured) {
  Random random(1);
  RobotErrors errors;
  errors.S = 0.03;
  Robot robot(2, errors);
  SharedErrorFilter filter(kPoints, {}, DepthPrior{3});
  robot.judge(filter);
  const RobotRun::Image& last = robot.run.images.back();
  const auto errorOf = [&](int i) {
    const double Z = last.Z[static_cast<std::size_t>(i)];
    return std::abs(filter.estimate(i).Z() - Z) / Z;
  };
  ASSERT_GE(last.points.size(), 2u);
  const int measured = last.points[0].id, other = last.points[1].id;
  EXPECT_GT(errorOf(other), 0.02);
  const double Z = last.Z[static_cast<std::size_t>(measured)];
  filter.correctDepth(measured, {Z, 0.001 / Z});
  EXPECT_LT(errorOf(other), 0.01);
}

}  // namespace
}  // namespace depthservo
