// InverseDepthFilter that considers the lasting errors of a robot (Schmidt 1966).
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "support/RobotExperiment.h"
#include "support/Trajectories.h"

namespace depthservo {
namespace {

using test::Random;
using test::Robot;
using test::RobotErrors;

constexpr double kDt = 1. / 30, kSigma = 1e-3;

/// A camera that moves in all directions.
Twist twistAt(double t) {
  return {{.2 * std::cos(t), .15 * std::sin(2 * t), .1 * std::sin(t + 1)},
          {.1 * std::sin(t), .2 * std::cos(1.5 * t), .15 * std::sin(t)}};
}

/// What is told of the camera's motion at this time.
using Told = std::function<Twist(double)>;

InverseDepthFilter after3s(const ErrorProfile& profile, const Told& told) {
  InverseDepthFilter::Options options = InverseDepthFilter::Options::considering(profile, 600);
  options.odometry = OdometryNoise::none();
  options.gate = 1e9;
  options.huber = 1e9;
  InverseDepthFilter filter(options);
  Eigen::Vector3d p(.2, -.1, 1.5);
  filter.reset({p.x() / p.z(), p.y() / p.z(), kSigma}, {1.5, .5});
  for (int i = 0; i < 90; ++i) {
    const double t = (i + .5) * kDt;
    p = test::moved(p, twistAt(t), kDt);
    filter.predict(Motion::fromTwist(told(t), kDt));
    filter.correct({p.x() / p.z(), p.y() / p.z(), kSigma});
  }
  return filter;
}

/// Checks sigma against the changes of chi that small errors really make.
/// \param sigma of each of these errors in the profile
void expectSigmaTells(const ErrorProfile& profile, double sigma,
                      const std::vector<Told>& unitErrors, double tolerance = .03) {
  constexpr double kSmall = 1e-5;
  const InverseDepthFilter right = after3s(profile, twistAt);
  double variance = 0;
  for (const Told& error : unitErrors) {
    const auto told = [&](double t) -> Twist {
      const Twist u = twistAt(t), du = error(t);
      return {u.linear + kSmall * du.linear, u.angular + kSmall * du.angular};
    };
    variance += std::pow((after3s(profile, told).chi() - right.chi()) / kSmall * sigma, 2);
  }
  const double considered = std::pow(right.estimate().sigma_chi, 2) - right.variance_chi();
  EXPECT_GT(variance, 0);
  EXPECT_NEAR(std::sqrt(considered), std::sqrt(variance), tolerance * std::sqrt(variance));
}

std::vector<Told> perAxis(const std::function<Twist(double, const Eigen::Vector3d&)>& error) {
  std::vector<Told> all;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis);
    all.push_back([=](double t) { return error(t, e); });
  }
  return all;
}

TEST(LastingErrors, sigmaContainsWhatAGyroBiasDoes) {
  ErrorProfile profile;
  profile.gyroBias_rad_s = .01;
  expectSigmaTells(profile, .01, perAxis([](double, const Eigen::Vector3d& e) -> Twist {
                     return {Eigen::Vector3d::Zero(), e};
                   }));
}

TEST(LastingErrors, sigmaContainsWhatATurnedMountDoes) {
  ErrorProfile profile;
  profile.mount_rad = .01;
  // The odometry is told in a frame that is turned by a unit rotation against the camera's.
  expectSigmaTells(profile, .01, perAxis([](double t, const Eigen::Vector3d& e) -> Twist {
                     return {e.cross(twistAt(t).linear), e.cross(twistAt(t).angular)};
                   }));
}

TEST(LastingErrors, takeTheSigmaOfEachAxisOfACalibratedRobot) {
  const auto sigma = [](double bias, double mount, const ErrorProfile::Values& values) {
    ErrorProfile profile;
    profile.gyroBias_rad_s = bias;
    profile.mount_rad = mount;
    profile.values = values;
    return after3s(profile, twistAt).estimate().sigma_chi;
  };
  ErrorProfile::Values each;
  each.gyroBiasSigma_rad_s.setConstant(.01);
  each.mountSigma_rad.setConstant(.02);
  EXPECT_DOUBLE_EQ(sigma(.05, .05, each), sigma(.01, .02, {}));
  each.gyroBiasSigma_rad_s.x() = .005;
  EXPECT_LT(sigma(.05, .05, each), sigma(.01, .02, {}));
  each.gyroBiasSigma_rad_s.x() = 0;  // not calibrated
  EXPECT_GT(sigma(.05, .05, each), sigma(.01, .02, {}));
}

TEST(LastingErrors, sigmaContainsWhatALatencyDoes) {
  ErrorProfile profile;
  profile.latency_s = .02;
  expectSigmaTells(profile, .02, {[](double t) -> Twist {
                     const Twist a = twistAt(t - .005), b = twistAt(t + .005);
                     return {(b.linear - a.linear) / .01, (b.angular - a.angular) / .01};
                   }},
                   .05);  // the filter takes changes from image to image for derivatives
}

/// A robot that errs as the profile of FeaturePoint allows.
RobotErrors ofArm(unsigned seed) {
  Random random(9000 + seed);
  const ErrorProfile p = ErrorProfile::arm();
  const auto three = [&](double sigma) {
    return Eigen::Vector3d(random.normal(sigma), random.normal(sigma), random.normal(sigma));
  };
  RobotErrors e;
  e.S = random.normal(p.scale);
  e.latency_s = random.normal(p.latency_s);
  e.kappa = 1 + random.normal(p.focal);
  e.mount = three(p.mount_rad);
  e.gyroNoise = p.odometry.sigma_w;
  e.wander_px = p.wander_px.sigma;
  return e;
}

TEST(LastingErrors, ofAnArmLeaveThePointsOfTheDropInHonest) {
  constexpr int kRobots = 24;
  const PointwiseEstimator prototype(
      InverseDepthFilter(InverseDepthFilter::Options::considering(ErrorProfile::arm(), 600)),
      Robot::kPoints, {3});
  double coverage = 0, valid = 0, white = 0;
  for (unsigned seed = 0; seed < kRobots; ++seed) {
    const Robot robot(seed, ofArm(seed));
    const auto estimator = prototype.clone();
    const test::Honesty honesty = robot.judge(*estimator);
    coverage += honesty.coverage / kRobots;
    valid += honesty.valid / kRobots;
    PointwiseEstimator declared(InverseDepthFilter(), Robot::kPoints, {3});
    white += robot.judge(declared).coverage / kRobots;
  }
  RecordProperty("coverage", std::to_string(coverage));
  std::printf("coverage %.3f, valid %.2f, white noise %.3f\n", coverage, valid, white);
  EXPECT_GE(coverage, .93);
  EXPECT_GE(valid, .6);
  EXPECT_LT(white, .7) << "without the profile: else there is nothing to consider";
}

}  // namespace
}  // namespace depthservo
