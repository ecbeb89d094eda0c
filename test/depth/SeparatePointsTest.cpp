// Points that see nothing of each other: as many estimators of one point each.
#include <gtest/gtest.h>

#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/SeparatePoints.h"
#include "support/EstimatorExperiment.h"

namespace depthservo {
namespace {

using namespace test;

constexpr int kPoints = 3, kImages = 40;

JointDepthFilter ofOne() { return JointDepthFilter(1); }

SimulatedRun drawn() {
  const Trajectory t = trajectory("T1");
  return simulate(t, t.fourPoints(), {OdometryNoise::white(.005, .002)}, 1, kImages);
}

/// \param places: which of the points are seen, by id
void feed(PointSetEstimator& estimator, const SimulatedRun& run, const std::vector<int>& places,
          int from = 0, int to = kImages) {
  const MotionBuffer odometry = run.odometry();
  for (int k = from; k < to; ++k) {
    std::vector<PointObservation> seen;
    for (const int id : places) {
      seen.push_back({id, run.measured[static_cast<std::size_t>(k)][static_cast<std::size_t>(id)]});
    }
    estimator.advance(odometry, k * Trajectory::kPeriod_s);
    estimator.correct(seen);
  }
}

void expectSame(const DepthEstimate& a, const DepthEstimate& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.chi, b.chi);
  EXPECT_EQ(a.sigma_chi, b.sigma_chi);
}

TEST(SeparatePoints, are_estimators_of_one_point_each) {
  const SimulatedRun run = drawn();
  SeparatePoints all(ofOne(), kPoints, {3});
  feed(all, run, {0, 1, 2});
  for (int id = 0; id < kPoints; ++id) {
    JointDepthFilter one = ofOne();
    one.setPrior(id, {3});
    feed(one, run, {id});
    expectSame(all.estimate(id), one.estimate(id));
    EXPECT_EQ(all.estimate(id).status, DepthStatus::valid);
  }
  EXPECT_EQ(all.time(), (kImages - 1) * Trajectory::kPeriod_s);
}

TEST(SeparatePoints, copies_go_their_own_way_and_begin_as_the_original) {
  const SimulatedRun run = drawn();
  SeparatePoints first(ofOne(), kPoints, {3});
  feed(first, run, {0, 1}, 0, 20);
  const SeparatePoints kept(first);
  const auto clone = first.clone();
  feed(first, run, {0, 1}, 20);
  EXPECT_NE(first.estimate(0).chi, kept.estimate(0).chi);
  expectSame(kept.estimate(0), clone->estimate(0));
  feed(*clone, run, {0, 1}, 20);
  expectSame(first.estimate(1), clone->estimate(1));
}

TEST(SeparatePoints, forget_what_they_are_told_to_forget) {
  const SimulatedRun run = drawn();
  SeparatePoints points(ofOne(), 2, {3});
  feed(points, run, {0, 1});
  EXPECT_FALSE(points.setPrior(2, {1})) << "there is no place for a third";
  EXPECT_EQ(points.estimate(2).status, DepthStatus::unset);
  EXPECT_FALSE(points.retire(2));
  EXPECT_TRUE(points.retire(0));
  EXPECT_EQ(points.estimate(0).status, DepthStatus::unset);
  EXPECT_EQ(points.estimate(1).status, DepthStatus::valid) << "the other one stays";
  EXPECT_TRUE(points.setPrior(2, {1})) << "in its place";
  points.reset();
  EXPECT_TRUE(std::isnan(points.time()));
  EXPECT_EQ(points.estimate(1).status, DepthStatus::unset);
  SeparatePoints fresh(ofOne(), 2, {3});
  feed(points, run, {0, 1});
  feed(fresh, run, {0, 1});
  expectSame(points.estimate(1), fresh.estimate(1));
}

}  // namespace
}  // namespace depthservo
