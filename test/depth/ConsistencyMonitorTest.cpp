#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "depthservo/depth/ConsistencyMonitor.h"
#include "support/EstimatorExperiment.h"
#include "support/Garbage.h"

namespace depthservo {
namespace {

using namespace test;
using Cause = ConsistencyMonitor::Cause;

const OdometryNoise kMeasured = OdometryNoise::white(.005, .002);

struct Watched {
  ConsistencyMonitor::Diagnosis diagnosis;  // after the last frame
  bool wasEverWrong = false;                // something was diagnosed at some time
  double varianceFactor = 1;
  std::vector<double> tooSmall;  // chi of each point, by the causes
};

Watched watch(const SimulatedRun& run, const ConsistencyMonitor::Options& options,
              double imageNoise = 1) {
  ConsistencyMonitor monitor(8, options);
  Watched watched;
  for (std::size_t k = 0; k < run.measured.size(); ++k) {
    if (k > 0) {
      monitor.predict(Motion::fromTwist(run.twist(static_cast<int>(k)), Trajectory::kPeriod_s));
    }
    std::vector<PointObservation> seen;
    for (std::size_t i = 0; i < run.measured[k].size(); ++i) {
      PointMeasurement z = run.measured[k][i];
      z.sigma *= imageNoise;
      seen.push_back({static_cast<int>(i), z});
    }
    monitor.correct(seen);
    watched.wasEverWrong |= monitor.diagnosis().cause != Cause::none;
  }
  watched.diagnosis = monitor.diagnosis();
  watched.varianceFactor = monitor.varianceFactor();
  for (std::size_t i = 0; i < run.guesses.size(); ++i) {
    double sum = 0;
    for (const Cause cause : ConsistencyMonitor::kModelled)
      sum += monitor.chiBy(cause, static_cast<int>(i));
    watched.tooSmall.push_back(sum);
  }
  EXPECT_EQ(monitor.chiBy(watched.diagnosis.cause, 1000), 0) << "no such point";
  return watched;
}

Watched watch(const SimulatedRun& run, const OdometryNoise& odometry, double imageNoise = 1) {
  ConsistencyMonitor::Options options;
  options.filter.odometry = odometry;
  return watch(run, options, imageNoise);
}

/// Filters that start as seldom anew as those of the monitor err by what the cause does to them.
void expectToldErrors(const SimulatedRun& run, const OdometryNoise& odometry, Cause named) {
  ConsistencyMonitor::Options options;
  options.filter.odometry = odometry;
  options.filter.gate = 1e6;
  const Watched watched = watch(run, options);
  EXPECT_EQ(watched.diagnosis.cause, named) << watched.diagnosis.message();
  for (std::size_t i = 0; i < run.guesses.size(); ++i) {
    SCOPED_TRACE("point " + std::to_string(i));
    const Trace trace = filtered(run, options.filter, i);
    const double error = run.chi.back()[i] - trace.chi.back();
    const double sigma = std::sqrt(trace.variance.back());
    EXPECT_GT(std::abs(error), 4 * sigma) << "else nothing is shown";
    EXPECT_NEAR(watched.tooSmall[i], error, 0.2 * std::abs(error) + 2 * sigma);
  }
}

TEST(ConsistencyMonitor, saysNothingInAHundredCleanRuns) {
  int runs = 0;
  for (const Trajectory& t : trajectories()) {
    for (const OdometryNoise& odometry : {OdometryNoise::none(), kMeasured}) {
      for (unsigned seed = 1; seed <= 6; ++seed, ++runs) {
        const Watched watched = watch(simulate(t, t.fourPoints(), {odometry}, seed), odometry);
        EXPECT_FALSE(watched.wasEverWrong) << t.name << ": " << watched.diagnosis.message();
        EXPECT_EQ(watched.varianceFactor, 1);
      }
    }
  }
  EXPECT_GE(runs, 100);
}

TEST(ConsistencyMonitor, namesALatencyOfOneFrameWithinThreeSeconds) {
  for (const char* name : {"T1", "T5"}) {
    const Trajectory t = trajectory(name);
    for (const OdometryNoise& odometry : {OdometryNoise::none(), kMeasured}) {
      for (unsigned seed = 1; seed <= 10; ++seed) {
        Conditions conditions{odometry};
        conditions.latency = 1;
        const auto d = watch(simulate(t, t.fourPoints(), conditions, seed, 91), odometry).diagnosis;
        EXPECT_EQ(d.cause, Cause::latency) << name << ", seed " << seed << ": " << d.message();
        EXPECT_NEAR(d.size, 1. / 30, .01);
      }
    }
  }
}

TEST(ConsistencyMonitor, namesAGyroBias) {
  const Trajectory t = trajectory("T5");
  SimulatedRun run = simulate(t, t.fourPoints(), {kMeasured}, 1);
  for (Twist& twist : run.twists) twist.angular.y() += .01;
  const auto d = watch(run, kMeasured).diagnosis;
  EXPECT_EQ(d.cause, Cause::gyroBias) << d.message();
  EXPECT_NEAR(d.size, .01, .002);
}

TEST(ConsistencyMonitor, namesAWrongFocalLength) {
  const Trajectory t = trajectory("T5");
  Conditions conditions{kMeasured};
  conditions.kappa = 1.05;
  const auto d = watch(simulate(t, t.fourPoints(), conditions, 1), kMeasured).diagnosis;
  EXPECT_EQ(d.cause, Cause::focalLength) << d.message();
  EXPECT_NEAR(d.size, .05, .01);
}

TEST(ConsistencyMonitor, namesATargetThatMoves) {
  // Along T1, on which a moving target and a gyro bias look different.
  const Trajectory t = trajectory("T1");
  SimulatedRun run = simulate(t, t.fourPoints(), {kMeasured}, 1);
  const Eigen::Vector3d velocity(.02, -.02, .01);
  std::vector<Eigen::Vector3d> points = t.fourPoints();
  Eigen::Matrix3d startRcamera = Eigen::Matrix3d::Identity();
  Random random(1);
  for (int k = 1; k < Trajectory::kFrames; ++k) {
    const Twist twist = t.twist(k - 1);
    const double dt = Trajectory::kPeriod_s;
    startRcamera = startRcamera * Motion::fromTwist(twist, dt).R.transpose();
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] = moved(points[i], twist, dt) + startRcamera.transpose() * velocity * dt;
      auto& z = run.measured[static_cast<std::size_t>(k)][i];
      z.x = points[i].x() / points[i].z() + random.normal(t.sigma());
      z.y = points[i].y() / points[i].z() + random.normal(t.sigma());
    }
  }
  const auto d = watch(run, kMeasured).diagnosis;
  EXPECT_EQ(d.cause, Cause::movingTarget) << d.message();
  EXPECT_NEAR(d.size, velocity.norm(), .01);
}

TEST(ConsistencyMonitor, tellsWhatACauseDoesToDepths) {
  const Trajectory t = trajectory("T5");
  Conditions conditions{kMeasured};
  conditions.kappa = 1.05;
  expectToldErrors(simulate(t, t.fourPoints(), conditions, 1), kMeasured, Cause::focalLength);
  conditions = {kMeasured};
  conditions.latency = 1;
  expectToldErrors(simulate(t, t.fourPoints(), conditions, 1), kMeasured, Cause::latency);
}

TEST(ConsistencyMonitor, tellsWhatACauseDoesToDepthsBeforeItIsNamed) {
  const Trajectory t = trajectory("T5");
  SimulatedRun biased = simulate(t, t.fourPoints(), {kMeasured}, 1, 61);
  for (Twist& twist : biased.twists) twist.angular.y() += .01;
  expectToldErrors(biased, kMeasured, Cause::none);
}

TEST(ConsistencyMonitor, tellsOutliersFromTooMuchNoise) {
  const Trajectory t = trajectory("T5");
  Conditions conditions{kMeasured};
  const SimulatedRun clean = simulate(t, t.fourPoints(), conditions, 1);
  conditions.outliers = .04;
  const SimulatedRun outliers = simulate(t, t.fourPoints(), conditions, 1);
  EXPECT_EQ(watch(outliers, kMeasured).diagnosis.cause, Cause::outliers);

  const Watched tooMuch = watch(clean, kMeasured, .5), tooLittle = watch(clean, kMeasured, 2);
  EXPECT_EQ(tooMuch.diagnosis.cause, Cause::noise);
  EXPECT_GT(tooMuch.diagnosis.size, 1);
  EXPECT_NEAR(tooMuch.varianceFactor, tooMuch.diagnosis.meanNis / 2, 1e-12);
  EXPECT_EQ(tooLittle.diagnosis.cause, Cause::noise);
  EXPECT_LT(tooLittle.diagnosis.size, 1);
  EXPECT_EQ(tooLittle.varianceFactor, 1) << "never shrunk";
}

TEST(ConsistencyMonitor, everyCauseHasItsMessageWithTheEvidence) {
  for (const Cause cause : {Cause::latency, Cause::gyroBias, Cause::focalLength,
                            Cause::movingTarget, Cause::outliers, Cause::noise}) {
    const ConsistencyMonitor::Diagnosis d{cause, .033, 7, 3.25, 400};
    EXPECT_NE(d.message().find("7 sigma"), std::string::npos) << d.message();
    EXPECT_NE(d.message().find("3.25 of 400"), std::string::npos) << d.message();
  }
  EXPECT_NE(ConsistencyMonitor::Diagnosis{}.message().find("agree"), std::string::npos);
}

TEST(ConsistencyMonitor, everyCauseHasANameAndASentenceThatFitsIt) {
  const std::map<Cause, const char*> own{{Cause::motion, "30 of 430 measurements are rejected"},
                                         {Cause::mount, "0.0400 rad"},
                                         {Cause::slip, "4.0 % of the speed"},
                                         {Cause::poseNoise, "40.0 mm"},
                                         {Cause::noise, "declare less noise"},
                                         {Cause::noData, "only 430 measurements"}};
  std::set<std::string> names;
  for (int i = 0; i <= static_cast<int>(Cause::noData); ++i) {
    const auto cause = static_cast<Cause>(i);
    const std::string name = ConsistencyMonitor::toString(cause);
    EXPECT_TRUE(names.insert(name).second) << name;
    const ConsistencyMonitor::Diagnosis d{cause, .04, 7, 3.25, 400, 30};
    const bool isOfMotion = cause >= Cause::motion && cause <= Cause::poseConvention;
    EXPECT_EQ(d.isMotion(), isOfMotion) << name;
    const auto words = isOfMotion ? own.find(Cause::motion) : own.find(cause);
    if (words == own.end()) continue;
    EXPECT_NE(d.message().find(words->second), std::string::npos) << d.message();
  }
  ConsistencyMonitor::Diagnosis tied{Cause::gyroBias, .033, 7, 3.25, 400};
  tied.rival = Cause::movingTarget;
  EXPECT_NE(tied.message().find("a target that moves would look nearly the same"),
            std::string::npos);
}

TEST(ConsistencyMonitor, survivesGarbage) {
  ConsistencyMonitor monitor(4);
  Random random(1);
  for (int k = 0; k < 3000; ++k) {
    monitor.predict(Motion::fromTwist(test::garbageTwist(random), test::garbage(random)));
    monitor.correct({{1, test::garbageMeasurement(random)},
                     {random.integer(0, 9), test::garbageMeasurement(random)}});
    ASSERT_TRUE(std::isfinite(monitor.varianceFactor()));
    ASSERT_TRUE(std::isfinite(monitor.diagnosis().size));
    ASSERT_TRUE(std::isfinite(monitor.diagnosis().evidence));
    ASSERT_TRUE(std::isfinite(monitor.diagnosis().meanNis));
  }
}

}  // namespace
}  // namespace depthservo
