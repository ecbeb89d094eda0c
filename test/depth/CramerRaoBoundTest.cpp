#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/depth/CramerRaoBound.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/EstimatorExperiment.h"
#include "support/RobotExperiment.h"

namespace depthservo {
namespace {

using namespace test;

struct Published {
  const char* trajectory;
  double perfect[5], noisy[5];  // sigma_Z / Z [%] at the checkpoints
};

TEST(CramerRaoBound, isThatOfTheTable) {
  const Published table[] = {
      {"T1", {14.41, 3.83, 1.415, .187, .114}, {14.75, 4.15, 1.805, .340, .239}},
      {"T1c", {2.98, .702, .374, .007, .013}, {3.88, 1.17, .802, .249, .360}},
      {"T2a", {15.98, 6.47, 3.203, .904, .201}, {22.22, 13.67, 11.24, 6.19, 2.89}},
      {"T2b", {118.5, 49.3, 4.378, .585, .157}, {164, 84.7, 13.2, 5.65, 2.72}},
      {"T3", {.360, .161, .119, .030, .021}, {.854, .668, .594, .343, .277}},
      {"T4", {.504, .230, .122, .075, .065}, {1.08, .862, .808, .824, .848}},
      {"T5", {2.91, 1.249, .190, .113, .073}, {5.27, 3.48, .885, .513, .377}}};
  for (const Published& row : table) {
    const Trajectory t = trajectory(row.trajectory);
    const auto perfect = boundOf(t, {t.cP}, OdometryNoise::none(), HUGE_VAL);
    const auto noisy = boundOf(t, {t.cP}, OdometryNoise::white(.005, .002), HUGE_VAL);
    for (std::size_t i = 0; i < kCheckpointCount; ++i) {
      const auto k = static_cast<std::size_t>(kCheckpoints[i]);
      EXPECT_NEAR(100 * perfect[k], row.perfect[i], .006 * row.perfect[i] + 6e-4) << t.name << k;
      EXPECT_NEAR(100 * noisy[k], row.noisy[i], .006 * row.noisy[i] + 6e-4) << t.name << k;
    }
  }
}

TEST(CramerRaoBound, ofPointsThatShareTheOdometryIsThatOfTheTable) {
  const struct {
    const char* trajectory;
    double percent[5];
  } table[] = {{"T1", {14.7, 4.09, 1.68, .31, .22}}, {"T2a", {20.2, 9.45, 4.81, 1.44, .41}},
               {"T2b", {136, 60, 5.66, .93, .32}},   {"T3", {.84, .66, .57, .33, .23}},
               {"T4", {1.05, .79, .68, .64, .64}},   {"T5", {5.07, 3.04, .82, .47, .32}}};
  for (const auto& row : table) {
    const Trajectory t = trajectory(row.trajectory);
    const auto bound = boundOf(t, t.fourPoints(), OdometryNoise::white(.005, .002), 5);
    for (std::size_t i = 0; i < kCheckpointCount; ++i) {
      const auto k = static_cast<std::size_t>(kCheckpoints[i]);
      EXPECT_NEAR(100 * bound[k], row.percent[i], .01 * row.percent[i] + 6e-3) << t.name << k;
    }
  }
}

TEST(CramerRaoBound, followsTheRuleOfThumbOfLateralMotion) {
  const double sigma = 1e-3, speed = .1, dt = .01, Z = 2;
  CramerRaoBound bound({{0, 0, 1 / Z}}, HUGE_VAL);
  const Motion motion = Motion::fromTwist({{speed, 0, 0}, {0, 0, 0}}, dt);
  const int frames = 300;
  bound.measure(0, sigma);
  for (int k = 0; k < frames; ++k) {
    bound.advance(motion, OdometryNoise::none());
    bound.measure(0, sigma);
  }
  const double rule = std::sqrt(12. / frames) * sigma * Z / (speed * dt * frames);
  EXPECT_NEAR(bound.relativeSigma(0), rule, .01 * rule);
}

TEST(CramerRaoBound, ofAnUnknownScaleIsTheScale) {
  ErrorProfile errors;
  errors.scale = .02;
  CramerRaoBound bound({{0, 0, .5}, {.2, .1, .8}}, HUGE_VAL, errors);
  for (int k = 0; k < 300; ++k) {
    for (std::size_t i = 0; i < 2; ++i) bound.measure(i, 1e-6);
    bound.advance(Motion::fromTwist({{.1, .05, 0}, {0, .1, 0}}, .01), OdometryNoise::none());
  }
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(bound.relativeSigma(i), .02, 1e-4);
}

/// The bound of all points of a perfect robot, and what the filter claims, at the end.
struct Limited {
  double bound = 0, claimed = 0;
};
Limited relativeSigmas(unsigned seed, const ErrorProfile& errors) {
  const Robot robot(seed, RobotErrors{});
  SharedErrorFilterOptions options;
  options.errors = errors;
  options.places = Robot::kPoints;
  SharedErrorFilter filter(Robot::kPoints, options, DepthPrior{3});
  std::vector<PointState> first;
  for (const PointObservation& o : robot.run.images.front().points) {
    first.push_back({o.measurement.x, o.measurement.y,
                     1 / robot.run.images.front().Z[static_cast<std::size_t>(o.id)]});
  }
  CramerRaoBound bound(first, HUGE_VAL, errors, kRobotFocal_px);
  double before_s = 0;
  std::vector<double> bounds, claimed;
  for (std::size_t k = 0; k < 300; ++k) {
    const RobotRun::Image& image = robot.run.images[k];
    if (k > 0) {
      bound.advance(robot.run.odometry.motion(before_s, image.stamp_s).motion, errors.odometry);
    }
    before_s = image.stamp_s;
    filter.advance(robot.run.odometry, image.stamp_s);
    filter.correct(image.points);
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (const PointObservation& o : image.points) {
        if (o.id == robot.run.images.front().points[i].id) bound.measure(i, o.measurement.sigma);
      }
    }
  }
  for (std::size_t i = 0; i < first.size(); ++i) {
    const DepthEstimate e = filter.estimate(robot.run.images.front().points[i].id);
    if (e.status != DepthStatus::valid) continue;
    bounds.push_back(bound.relativeSigma(i));
    claimed.push_back(e.sigma_chi / e.chi);
  }
  return {Robot::median(bounds), Robot::median(claimed)};
}

TEST(CramerRaoBound, withLastingErrorsIsNearlyWhatTheFilterClaims) {
  for (const unsigned seed : {0u, 2u, 4u}) {  // these see all their points all the time
    const Limited typical = relativeSigmas(seed, ErrorProfile::typical());
    EXPECT_GE(typical.claimed, .9 * typical.bound) << seed;
    EXPECT_LE(typical.claimed, 1.1 * typical.bound) << seed;
    const Limited arm = relativeSigmas(seed, ErrorProfile::arm());
    EXPECT_GE(arm.claimed, .9 * arm.bound) << seed;
    EXPECT_LE(arm.claimed, 1.1 * arm.bound) << seed;
    EXPECT_LT(arm.bound, typical.bound) << seed;
  }
}

TEST(CramerRaoBound, takesTheSigmaOfEachAxisOfACalibratedRobot) {
  ErrorProfile one = ErrorProfile::arm();
  one.gyroBias_rad_s = .003;
  one.mount_rad = .004;
  ErrorProfile each = ErrorProfile::arm();
  each.gyroBias_rad_s = each.mount_rad = .1;
  each.values.gyroBiasSigma_rad_s.setConstant(.003);
  each.values.mountSigma_rad.setConstant(.004);
  const Limited expected = relativeSigmas(0, one), calibrated = relativeSigmas(0, each);
  EXPECT_NEAR(calibrated.bound, expected.bound, 1e-12);
  EXPECT_NEAR(calibrated.claimed, expected.claimed, 1e-12);
}

TEST(CramerRaoBound, isInfiniteBehindTheCamera) {
  CramerRaoBound bound({{0, 0, 1}, {0, 0, .1}}, 5);
  bound.advance(Motion::fromTwist({{0, 0, 2}, {0, 0, 0}}, 1), OdometryNoise::none());
  bound.measure(0, 1e-3);
  EXPECT_TRUE(std::isinf(bound.sigma_chi(0)));
  EXPECT_TRUE(std::isfinite(bound.sigma_chi(1)));
}

TEST(BenchmarkTrajectories, endWhereTheTableSays) {
  const struct {
    const char* name;
    double Z, u, v;
  } ends[] = {{"T1", 1.884727, -14.3161, 11.9544},  {"T2a", .973293, 51.2010, 61.6464},
              {"T2b", .973287, -53.5982, -12.3294}, {"T3", 1, 33.9991, -30},
              {"T4", .990083, -15.6376, 187.6051},  {"T5", 1.446077, -31.6406, 9.0675}};
  for (const auto& end : ends) {
    const Trajectory t = trajectory(end.name);
    Eigen::Vector3d p = t.cP;
    for (int k = 0; k + 1 < Trajectory::kFrames; ++k) p = moved(p, t.twist(k), t.kPeriod_s);
    EXPECT_NEAR(p.z(), end.Z, 1e-6) << end.name;
    EXPECT_NEAR(t.focal_px * p.x() / p.z(), end.u, 1e-4) << end.name;
    EXPECT_NEAR(t.focal_px * p.y() / p.z(), end.v, 1e-4) << end.name;
  }
}

}  // namespace
}  // namespace depthservo
