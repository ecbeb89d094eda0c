#include <gtest/gtest.h>

#include "depthservo/depth/ConsistencyMonitor.h"
#include "depthservo/depth/InverseDepthFilterBatch.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NoiseLearner.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/AllocationCounter.h"
#include "support/EstimatorExperiment.h"

namespace depthservo {
namespace {

using namespace test;

TEST(FilterAllocation, noneOfTheFiltersAllocatesInTheLoop) {
  const Trajectory t = trajectory("T5");
  std::vector<Eigen::Vector3d> points;
  Random random(1);
  for (int i = 0; i < 10; ++i) points.push_back(t.cP + random.vector(.3));
  Conditions conditions;
  conditions.outliers = .02;
  const SimulatedRun run = simulate(t, points, conditions, 1);
  const MotionBuffer odometry = run.odometry();
  std::vector<std::vector<PointObservation>> seen(run.measured.size());
  std::vector<std::vector<double>> x(seen.size()), y(seen.size()), sigma(seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PointMeasurement& z = run.measured[k][i];
      seen[k].push_back({static_cast<int>(i), z});
      x[k].push_back(z.x);
      y[k].push_back(z.y);
      sigma[k].push_back(z.sigma);
    }
  }
  InverseDepthFilter filter;
  InverseDepthFilterBatch batch(points.size());
  JointDepthFilterOptions options;
  options.estimateGyroBias = options.estimateFocal = true;
  JointDepthFilter joint(points.size(), options);
  SharedErrorFilterOptions few;
  few.places = 2;
  SharedErrorFilter shared(points.size(), few);
  SeparatePoints separate(SharedErrorFilter(1, few), points.size(), {});
  NoiseLearner learner(points.size(), few, 0.5);
  ConsistencyMonitor monitor(points.size());

  const std::size_t before = allocations();
  for (int round = 0; round < 10; ++round) {
    filter.reset(run.measured[0][0], {1});
    for (std::size_t i = 0; i < points.size(); ++i) batch.reset(i, run.measured[0][i], {1});
    joint.reset();
    shared.reset();
    separate.reset();
    monitor.reset();
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const Motion motion = Motion::fromTwist(run.twist(static_cast<int>(k)), t.kPeriod_s);
      filter.predict(motion);
      filter.correct(run.measured[k][0]);
      filter.correctDepth({1.5, 1});
      batch.predict(motion);
      batch.correct(x[k].data(), y[k].data(), sigma[k].data());
      joint.advance(odometry, static_cast<double>(k) * t.kPeriod_s);
      joint.correct(seen[k]);
      for (PointSetEstimator* set :
           {static_cast<PointSetEstimator*>(&shared), static_cast<PointSetEstimator*>(&separate)}) {
        set->advance(odometry, static_cast<double>(k) * t.kPeriod_s);
        set->correct(seen[k]);
        learner.observe(motion, seen[k], *set);
        set->setNoise(learner.noise());
        set->correctDepth(0, {1.5, 1});
        if (k % 50 == 49) set->retire(1);
        if (set->estimate(0).chi < 0) break;
      }
      monitor.predict(motion);
      monitor.correct(seen[k]);
      if (joint.estimate(0).chi + batch.estimate(0).chi + filter.estimate().chi < 0) break;
      if (monitor.diagnosis().values < 0) break;
    }
  }
  EXPECT_EQ(allocations() - before, 0u);
}

}  // namespace
}  // namespace depthservo
