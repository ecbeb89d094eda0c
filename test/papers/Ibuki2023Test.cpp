// The simulations of Ibuki et al. 2023 within the figures of an independent computation.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "depthservo/papers/Reproduce.h"
#include "papers/Ibuki2023.h"

namespace depthservo {
namespace {

using namespace ibuki2023;
using LostFrames = VisualMotionObserverOptions::LostFrames;

/// The paper's experiment does not meet the paper's own condition, and the gains that the paper
/// chose are not those of its own optimum; everything else holds.
TEST(Ibuki2023, everyFigureIsReproducedAndThreeClaimsAreNot) {
  const std::set<std::string> refuted = {"ibuki2023/conditions/experiment/eq23",
                                         "ibuki2023/design/60Hz-U0/ke",
                                         "ibuki2023/design/60Hz-U0/gamma"};
  std::set<std::string> ids;
  const Reproduction reproduction = reproduce("ibuki2023");
  const auto& rows = reproduction.rows;
  EXPECT_GT(rows.size(), 160u);
  for (const Figure& figure : reproduction.figures) {
    EXPECT_FALSE(figure.title.empty() || figure.caption.empty()) << figure.name;
  }
  for (const JudgedClaim& row : rows) {
    EXPECT_TRUE(row.pass) << row.id << ": expected " << row.expected << ", ours " << row.ours;
    EXPECT_EQ(row.reproduces, !refuted.count(row.id)) << row.id;
    EXPECT_TRUE(std::isfinite(row.ours)) << row.id;
    EXPECT_FALSE(row.claim.empty()) << row.id;
    EXPECT_TRUE(ids.insert(row.id).second) << row.id << " comes twice";
  }
}

TEST(Ibuki2023, figuresHaveNoEmptyCurve) {
  const std::vector<Figure> all = figures({});
  EXPECT_EQ(all.size(), 6u);
  for (const Figure& figure : all) {
    for (const Panel& panel : figure.panels) {
      ASSERT_FALSE(panel.curves.empty()) << figure.name;
      for (const Curve& curve : panel.curves) {
        ASSERT_GE(curve.x.size(), 2u) << figure.name << ": " << curve.title;
        ASSERT_EQ(curve.x.size(), curve.y.size());
        for (const double y : curve.y) ASSERT_TRUE(std::isfinite(y)) << curve.title;
      }
    }
  }
}

/// The dots of the experiment may not be so large that they merge as the target turns.
TEST(Ibuki2023, renderedImagesGiveWhatThePointsGive) {
  Experiment b = experimentB();
  b.source = ErrorSource::image;
  const Trace points = simulate(b), images = simulate(rendered(b));
  EXPECT_EQ(images.framesWithAllPoints, images.framesTaken);
  ASSERT_EQ(points.samples.size(), images.samples.size());
  for (std::size_t i = 0; i < points.samples.size(); ++i) {
    ASSERT_NEAR(images.samples[i].e, points.samples[i].e, 2e-3) << points.samples[i].time_s;
  }
}

TEST(Ibuki2023, sameSeedGivesTheSameNoise) {
  Experiment c = experimentB();
  c.source = ErrorSource::image;
  c.noise_px = .5;
  c.end_s = 2;
  const auto end = [&] { return simulate(c).samples.back().e; };
  const double once = end();
  EXPECT_EQ(once, end());
  c.seed = 2;
  EXPECT_NE(once, end());
}

TEST(Ibuki2023, errorStaysWithinTheGuaranteedBoundAtTheGuaranteedRate) {
  for (const Experiment& experiment : {simulationA(60), simulationAVariable()}) {
    const Trace t = simulate(experiment);
    EXPECT_LT(t.largest(.06, 60), 7.8168);
  }
}

TEST(Ibuki2023, tooSlowACameraDivergesAndTheGuardSavesIt) {
  for (const Law law : {Law::coupled, Law::cascade}) {
    Experiment slow = simulationA(.6);
    slow.law = law;
    slow.substeps = 500;
    EXPECT_TRUE(std::isinf(simulate(slow).samples.back().e));
    slow.lostFrames = LostFrames::guarded;
    EXPECT_LT(simulate(slow).before(60), 1e-3);
  }
}

TEST(Ibuki2023, planarRobotNeverMovesOutOfItsPlane) {
  for (const Sample& sample : simulate(experimentB()).samples) {
    ASSERT_EQ(sample.twist.linear.y(), 0);
    ASSERT_EQ(sample.twist.angular.x(), 0);
    ASSERT_EQ(sample.twist.angular.z(), 0);
  }
}

}  // namespace
}  // namespace depthservo
