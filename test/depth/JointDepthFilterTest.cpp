#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/depth/JointDepthFilter.h"
#include "support/EstimatorExperiment.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using namespace test;

const OdometryNoise kMeasured = OdometryNoise::white(.005, .002);

JointDepthFilterOptions withOdometry(const OdometryNoise& odometry) {
  JointDepthFilterOptions options;
  options.filter.odometry = odometry;
  return options;
}

TEST(JointDepthFilter, reachesTheJointBoundFarBelowThatOfPointsAlone) {
  const Trajectory t = trajectory("T2a");
  JointDepthFilterOptions options = withOdometry(kMeasured);
  options.estimateTimeOffset = false;
  const auto bound = boundOf(t, t.fourPoints(), kMeasured, 5);
  Statistics statistics;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const SimulatedRun run = simulate(t, t.fourPoints(), {kMeasured}, seed);
    JointDepthFilter filter(4, options);
    statistics.add(run, filtered(run, filter));
  }
  for (std::size_t i = 2; i < kCheckpointCount; ++i) {
    EXPECT_LT(statistics.rmse(i) / bound[static_cast<std::size_t>(kCheckpoints[i])], 1.4);
    EXPECT_GT(statistics.nees(i), .5);
    EXPECT_LT(statistics.nees(i), 1.9);
  }
  EXPECT_LT(statistics.rmse(4), .3 * boundOf(t, {t.cP}, kMeasured, 5).back());
}

TEST(JointDepthFilter, findsOutHowLateTheImagesAre) {
  for (const char* name : {"T1", "T5"}) {
    const Trajectory t = trajectory(name);
    for (const bool isNoisy : {false, true}) {
      Conditions conditions{isNoisy ? kMeasured : OdometryNoise::none()};
      conditions.latency = 1;
      Statistics statistics;
      const auto bound = boundOf(t, t.fourPoints(), conditions.odometry, 5);
      for (unsigned seed = 1; seed <= 20; ++seed) {
        const SimulatedRun run = simulate(t, t.fourPoints(), conditions, seed);
        JointDepthFilter filter(4, withOdometry(conditions.odometry));
        statistics.add(run, filtered(run, filter));
        const JointDepthFilter::Common offset = filter.timeOffset();
        EXPECT_TRUE(offset.isObserved);
        EXPECT_NEAR(offset.value, 1. / 30, isNoisy ? 2e-3 : 4e-4) << name << ", seed " << seed;
      }
      EXPECT_LT(statistics.rmse(4), 1.9 * bound.back()) << name;
    }
  }
}

TEST(JointDepthFilter, oneFeatureIsEnoughForTheTimeOffset) {
  const Trajectory t = trajectory("T5");
  Conditions conditions;
  conditions.latency = 1;
  const SimulatedRun run = simulate(t, {t.cP}, conditions, 1);
  JointDepthFilter with(1, withOdometry(conditions.odometry));
  const Trace trace = filtered(run, with);
  EXPECT_NEAR(trace.chi.back() / run.chi.back()[0], 1, .01);
}

TEST(JointDepthFilter, timeOffsetIsNotObservedAtRestOrAtConstantTwist) {
  for (const Twist& twist : {Twist{}, Twist{{.1, 0, 0}, {0, 0, .1}}}) {
    Trajectory t = trajectory("S0");
    t.twistAt = [twist](double) { return twist; };
    for (const OdometryNoise& odometry : {OdometryNoise::none(), kMeasured}) {
      const SimulatedRun run = simulate(t, t.fourPoints(), {odometry}, 1);
      JointDepthFilter filter(4, withOdometry(odometry));
      filtered(run, filter);
      EXPECT_FALSE(filter.timeOffset().isObserved);
      EXPECT_GT(filter.timeOffset().sigma, .9 / 30);
    }
  }
}

TEST(JointDepthFilter, recoversAFocalLengthFivePercentOffUnderGeneralMotion) {
  const Trajectory t = trajectory("T5");
  for (const bool isNoisy : {false, true}) {
    Conditions conditions{isNoisy ? kMeasured : OdometryNoise::none()};
    conditions.kappa = 1.05;
    for (unsigned seed = 1; seed <= 10; ++seed) {
      const SimulatedRun run = simulate(t, t.fourPoints(), conditions, seed);
      JointDepthFilterOptions options = withOdometry(conditions.odometry);
      options.estimateFocal = true;
      JointDepthFilter filter(4, options);
      const Trace trace = filtered(run, filter);
      EXPECT_TRUE(filter.focal().isObserved);
      EXPECT_NEAR(filter.focal().value, 1.05, .00525) << "seed " << seed;
      EXPECT_NEAR(trace.chi.back() / run.chi.back()[0], 1, .02);
      EXPECT_NEAR(filter.estimate(0).x, run.measured.back()[0].x, 5 * t.sigma())
          << "reported in the coordinates of the measurements";
    }
  }
}

TEST(JointDepthFilter, focalLengthIsNotTouchedByRestOrPureSidewaysMotion) {
  for (const char* name : {"S0", "T3"}) {
    const Trajectory t = trajectory(name);
    for (const OdometryNoise& odometry : {OdometryNoise::none(), kMeasured}) {
      JointDepthFilterOptions options = withOdometry(odometry);
      options.estimateFocal = true;
      JointDepthFilter filter(4, options);
      Conditions conditions{odometry};
      conditions.kappa = 1.05;
      filtered(simulate(t, t.fourPoints(), conditions, 1), filter);
      EXPECT_FALSE(filter.focal().isObserved) << name;
      EXPECT_NEAR(filter.focal().value, 1, odometry.sigma_v > 0 ? .02 : 1e-9) << name;
      EXPECT_GT(filter.focal().sigma, .09) << name;
    }
  }
}

TEST(JointDepthFilter, findsTheGyroBias) {
  const Trajectory t = trajectory("T5");
  const Eigen::Vector3d bias(.01, -.005, .02);
  SimulatedRun run = simulate(t, t.fourPoints(), {}, 1);
  for (Twist& twist : run.twists) twist.angular += bias;
  JointDepthFilterOptions options = withOdometry(OdometryNoise::none());
  options.estimateGyroBias = true;
  JointDepthFilter filter(4, options);
  const Trace trace = filtered(run, filter);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(filter.gyroBias(axis).isObserved);
    EXPECT_NEAR(filter.gyroBias(axis).value, bias[axis], 3e-4);
  }
  EXPECT_NEAR(trace.chi.back() / run.chi.back()[0], 1, .01);
  EXPECT_FALSE(JointDepthFilter(1).gyroBias(0).isEstimated);
}

TEST(JointDepthFilter, aboveEightPointsTheOthersGetItsTimeOffset) {
  const Trajectory t = trajectory("T5");
  std::vector<Eigen::Vector3d> points;
  Random random(1);
  for (int i = 0; i < 14; ++i) points.push_back(t.cP + random.vector(.3));
  Conditions conditions;
  conditions.latency = 1;
  const SimulatedRun run = simulate(t, points, conditions, 1);
  JointDepthFilter filter(14, withOdometry(conditions.odometry));
  filtered(run, filter);
  std::size_t joint = 0;
  for (int i = 0; i < 14; ++i) {
    joint += filter.isJoint(i);
    EXPECT_NEAR(filter.estimate(i).chi / run.chi.back()[static_cast<std::size_t>(i)], 1, .03) << i;
  }
  EXPECT_EQ(joint, JointDepthFilter::kJointPoints);
}

TEST(JointDepthFilter, jointPointThatStaysHiddenGivesItsPlaceToAnother) {
  const Trajectory t = trajectory("T5");
  std::vector<Eigen::Vector3d> points;
  Random random(2);
  for (int i = 0; i < 9; ++i) points.push_back(t.cP + random.vector(.3));
  const SimulatedRun run = simulate(t, points, {}, 1);
  const MotionBuffer odometry = run.odometry();
  JointDepthFilter filter(9, withOdometry(OdometryNoise::none()));
  int hidden = -1;
  for (int k = 0; k < Trajectory::kFrames; ++k) {
    filter.advance(odometry, k * Trajectory::kPeriod_s);
    std::vector<PointObservation> seen;
    for (int i = 0; i < 9; ++i) {
      if (i == hidden && k < 200) continue;
      seen.push_back({i, run.measured[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)]});
    }
    filter.correct(seen);
    if (k == 50) {
      for (int i = 0; i < 9; ++i) hidden = filter.isJoint(i) ? i : hidden;
    }
  }
  EXPECT_FALSE(filter.isJoint(hidden));
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(filter.estimate(i).chi / run.chi.back()[static_cast<std::size_t>(i)], 1, .02) << i;
  }
}

TEST(JointDepthFilter, aRetiredPointLeavesItsPlaceToAnotherAndTheRestAlone) {
  const Trajectory t = trajectory("T5");
  const SimulatedRun run = simulate(t, t.fourPoints(), {}, 1);
  const MotionBuffer odometry = run.odometry();
  JointDepthFilter hiding(4, withOdometry(OdometryNoise::none()));
  JointDepthFilter retiring(4, withOdometry(OdometryNoise::none()));
  for (int k = 0; k < 120; ++k) {
    hiding.advance(odometry, k * Trajectory::kPeriod_s);
    retiring.advance(odometry, k * Trajectory::kPeriod_s);
    if (k == 60) {
      EXPECT_TRUE(retiring.retire(0));
    }
    std::vector<PointObservation> seen;
    for (int i = k < 60 ? 0 : 1; i < 4; ++i) {
      seen.push_back({i, run.measured[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)]});
    }
    hiding.correct(seen);
    retiring.correct(seen);
  }
  for (int i = 1; i < 4; ++i) {
    EXPECT_NEAR(retiring.estimate(i).chi, hiding.estimate(i).chi, 1e-9) << i;
    EXPECT_NEAR(retiring.estimate(i).sigma_chi, hiding.estimate(i).sigma_chi, 1e-9) << i;
  }
  EXPECT_EQ(retiring.estimate(0).status, DepthStatus::unset);
  EXPECT_FALSE(retiring.retire(0));
  EXPECT_TRUE(retiring.setPrior(77, {1}));
  EXPECT_FALSE(retiring.setPrior(78, {1}));
}

TEST(JointDepthFilter, declaredScaleUncertaintyIsInTheReportedSigma) {
  const Trajectory t = trajectory("T5");
  JointDepthFilterOptions options = withOdometry(OdometryNoise::none());
  options.filter.odometryScaleSigma = .02;
  JointDepthFilter filter(4, options);
  const Trace trace = filtered(simulate(t, t.fourPoints(), {}, 1), filter);
  EXPECT_NEAR(std::sqrt(trace.variance.back()) / trace.chi.back(), .02, .001);
}

TEST(JointDepthFilter, keepsTheContractOfLateMissingAndReversedOdometry) {
  MotionBuffer odometry(64);
  for (int k = 0; k < 31; ++k) odometry.push(k * .1, {{.1, 0, 0}, {0, 0, 0}});
  JointDepthFilter filter(2, {}, {2.5, .01});
  EXPECT_TRUE(std::isnan(filter.time()));
  EXPECT_EQ(filter.advance(odometry, std::nan("")), Coverage::reversed);
  EXPECT_EQ(filter.advance(odometry, .5), Coverage::complete);
  EXPECT_EQ(filter.estimate(3).status, DepthStatus::unset);
  EXPECT_NEAR(filter.estimate(3).Z(), 2.5, 1e-12);
  filter.correct({{3, {.1, 0, 1e-3}}});
  EXPECT_EQ(filter.advance(odometry, 3.3), Coverage::afterEnd);
  EXPECT_EQ(filter.advance(odometry, .2), Coverage::reversed);
  EXPECT_EQ(filter.time(), .5);
  EXPECT_EQ(filter.estimate(3).x, .1);
  EXPECT_EQ(filter.advance(odometry, 1), Coverage::complete);
  EXPECT_EQ(filter.estimate(3).status, DepthStatus::coasting);
  EXPECT_EQ(filter.advance(MotionBuffer(), 2), Coverage::empty);
  EXPECT_EQ(filter.time(), 2);
  EXPECT_EQ(filter.estimate(3).status, DepthStatus::unset);
}

TEST(JointDepthFilter, capacityPriorsCloneAndReset) {
  JointDepthFilter filter(2);
  MotionBuffer odometry(8, 10);
  odometry.push(0, {{.1, 0, 0}, {0, 0, 0}});
  filter.advance(odometry, 0);
  EXPECT_TRUE(filter.setPrior(7, {3}));
  filter.correct({{7, {.1, 0, 1e-3}}, {8, {0, 0, 1e-3}}, {9, {0, 0, 1e-3}}});
  EXPECT_EQ(filter.ignored(), 1u);
  EXPECT_FALSE(filter.setPrior(9, {3}));
  EXPECT_NEAR(filter.estimate(7).Z(), 3, 1e-12);
  filter.correctDepth(7, {2, 1e-3});
  EXPECT_NEAR(filter.estimate(7).Z(), 2, 1e-3);
  const auto clone = filter.clone();
  EXPECT_TRUE(filter.setPrior(7, {4}));
  EXPECT_EQ(filter.estimate(7).status, DepthStatus::unset);
  filter.correct({{7, {.2, 0, 1e-3}}});
  EXPECT_NEAR(filter.estimate(7).Z(), 4, 1e-12) << "started anew";
  clone->advance(odometry, .1);
  EXPECT_NEAR(clone->estimate(7).Z(), 2, 1e-3);
  EXPECT_EQ(filter.time(), 0);
  filter.reset();
  EXPECT_TRUE(std::isnan(filter.time()));
  EXPECT_EQ(filter.estimate(8).status, DepthStatus::unset);
}

}  // namespace
}  // namespace depthservo
