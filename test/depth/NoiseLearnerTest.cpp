// Whether the noise of pixels and of poses is learnt, in a world that is simulated here.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "depthservo/depth/NoiseLearner.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

constexpr double kFocal_px = 500, kPeriod_s = 1 / 30., kTau_s = 0.5;
constexpr std::size_t kPoints = 80;

struct World {
  NoiseLevel position_m, angle_rad, pixel_px;
  double outliers = 0;   // share of the measurements
  double told_px = 0.1;  // with them
  double duration_s = 6;
  ErrorProfile profile = ErrorProfile::poses();
  bool learns = true;
};

struct Result {
  MeasurementNoise noise;
  double factor = 1, coverage = 0, valid = 0;
};

/// Values of so much noise, one set an image.
class Noise {
 public:
  Noise(const NoiseLevel& level, std::size_t size, Random& random)
      : level_(level), random_(random), lasting_(size) {
    for (double& value : lasting_) value = random_.normal(level_.lasting.sigma);
  }
  void next() {
    const double kept = level_.lasting.kept(kPeriod_s);
    for (double& value : lasting_) {
      value = kept * value + random_.normal(level_.lasting.sigma * std::sqrt(1 - kept * kept));
    }
  }
  double operator()(std::size_t i) const { return lasting_[i] + random_.normal(level_.white); }
  Eigen::Vector3d vector() const { return {(*this)(0), (*this)(1), (*this)(2)}; }

 private:
  NoiseLevel level_;
  Random& random_;
  std::vector<double> lasting_;
};

Eigen::Isometry3d poseAt(double t) {
  Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
  wMc.translation() << 0.15 * std::sin(1.9 * t), 0.1 * std::sin(1.3 * t), 0.1 * std::sin(0.7 * t);
  wMc.linear() = Eigen::AngleAxisd(0.1 * std::sin(1.1 * t), Eigen::Vector3d(1, 2, 3).normalized())
                     .toRotationMatrix();
  return wMc;
}

Result observe(const World& world, unsigned seed) {
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double Z = random.uniform(1, 3);
    points.emplace_back(random.uniform(-.5, .5) * Z, random.uniform(-.4, .4) * Z, Z);
  }
  Noise position(world.position_m, 3, random), angle(world.angle_rad, 3, random),
      pixel(world.pixel_px, 2 * kPoints, random);
  SharedErrorFilterOptions options;
  options.errors = world.profile;
  options.errors.focal = 0;
  options.focal_px = kFocal_px;
  SeparatePoints estimator(SharedErrorFilter(1, options, DepthPrior{2}), kPoints, DepthPrior{2});
  NoiseLearner learner(kPoints, options, world.told_px);
  MotionBuffer motion(1000);
  std::vector<PointObservation> seen;
  Result result;
  int valid = 0, measured = 0, covered = 0;
  std::optional<Eigen::Isometry3d> before;
  for (int k = 0; k * kPeriod_s < world.duration_s; ++k) {
    const double t = k * kPeriod_s;
    const Eigen::Isometry3d wMc = poseAt(t);
    position.next(), angle.next(), pixel.next();
    const Eigen::Vector3d turn = angle.vector();
    Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
    error.linear() =
        Eigen::AngleAxisd(turn.norm(), (turn + Eigen::Vector3d(0, 0, 1e-12)).normalized())
            .toRotationMatrix();
    error.translation() = position.vector();
    const Eigen::Isometry3d told = wMc * error;
    Motion moved;
    if (before) {
      moved = Motion::fromPoses(*before, told, kPeriod_s);
      motion.push(t - kPeriod_s, moved.twist());
      motion.holdUntil(t);
    }
    before = told;
    seen.clear();
    const double scale = (world.learns ? learner.pixelFactor() : 1) / kFocal_px;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d P = wMc.inverse() * points[i];
      double x = P.x() / P.z() + pixel(2 * i) / kFocal_px,
             y = P.y() / P.z() + pixel(2 * i + 1) / kFocal_px;
      if (random.uniform(0, 1) < world.outliers) {
        x += random.normal(20 / kFocal_px);
        y += random.normal(20 / kFocal_px);
      }
      seen.push_back({static_cast<int>(i), {x, y, scale * world.told_px}});
    }
    estimator.advance(motion, t);
    estimator.correct(seen);
    learner.observe(moved, seen, estimator);
    if (world.learns) estimator.setNoise(learner.noise());
    for (std::size_t i = 0; i < kPoints; ++i) {
      const DepthEstimate e = estimator.estimate(static_cast<int>(i));
      const double Z = (wMc.inverse() * points[i]).z();
      measured += t > 3;
      if (e.status != DepthStatus::valid) continue;
      valid += t > 3;
      covered += t > 3 && std::abs(e.Z() - Z) < 2 * e.sigma_Z();
    }
  }
  result.noise = learner.noise();
  result.factor = learner.pixelFactor();
  result.coverage = static_cast<double>(covered) / valid;
  result.valid = static_cast<double>(valid) / measured;
  return result;
}

/// Means over seeds.
Result meanOf(const World& world) {
  constexpr unsigned kSeeds = 8;
  Result mean;
  mean.factor = 0;
  const auto add = [](NoiseLevel& sum, const NoiseLevel& one) {
    sum.white += one.white / kSeeds;
    sum.lasting.sigma += one.lasting.sigma / kSeeds;
  };
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const Result one = observe(world, seed);
    add(mean.noise.position_m, one.noise.position_m);
    add(mean.noise.angle_rad, one.noise.angle_rad);
    add(mean.noise.pixel_px, one.noise.pixel_px);
    mean.factor += one.factor / kSeeds;
    mean.coverage += one.coverage / kSeeds;
    mean.valid += one.valid / kSeeds;
  }
  return mean;
}

void expectNear(double value, double truth, double share) {
  EXPECT_NEAR(value, truth, share * truth);
}

TEST(NoiseLearner, learnsTheWhiteNoiseOfPixelsAndPoses) {
  const Result r = meanOf({{0.003, {}}, {0.002, {}}, {0.3, {}}});
  expectNear(r.noise.position_m.white, 0.003, 0.1);
  expectNear(r.noise.angle_rad.white, 0.002, 0.1);
  expectNear(r.noise.pixel_px.white, 0.3, 0.1);
  expectNear(r.factor, 3, 0.1);
  EXPECT_LT(r.noise.angle_rad.lasting.sigma, 0.0005);
  EXPECT_GE(r.coverage, 0.9);
  EXPECT_GE(r.valid, 0.9);
}

TEST(NoiseLearner, learnsThatPosesAreBetterThanTheProfile) {
  const Result r = meanOf({{0.0003, {}}, {0.0002, {}}, {0.1, {}}});
  expectNear(r.noise.position_m.white, 0.0003, 0.1);
  expectNear(r.noise.angle_rad.white, 0.0002, 0.1);
  expectNear(r.noise.pixel_px.white, 0.1, 0.1);
  EXPECT_GE(r.coverage, 0.95);
}

TEST(NoiseLearner, learnsWhatLasts) {
  const Result r = meanOf({{0.001, {0.004, kTau_s}}, {0.001, {0.003, kTau_s}}, {0.1, {0.3, 0.7}}});
  expectNear(r.noise.position_m.lasting.sigma, 0.004, 0.15);
  expectNear(r.noise.angle_rad.lasting.sigma, 0.003, 0.15);
  expectNear(r.noise.pixel_px.lasting.sigma, 0.3, 0.15);
  expectNear(r.noise.pixel_px.white, 0.1, 0.15);
  EXPECT_GE(r.coverage, 0.9);
}

TEST(NoiseLearner, isNotMisledByTenthOfWrongMeasurements) {
  World world{{0.003, {}}, {0.002, {}}, {0.3, {}}};
  world.outliers = 0.1;
  const Result r = meanOf(world);
  expectNear(r.noise.position_m.white, 0.003, 0.15);
  expectNear(r.noise.angle_rad.white, 0.002, 0.15);
  EXPECT_LT(r.noise.pixel_px.white, 1.5 * 0.3);
  EXPECT_GE(r.coverage, 0.9);
}

TEST(NoiseLearner, makesDepthsHonestThatAProfileLeavesFarTooSure) {
  World world{{0.001, {0.004, kTau_s}}, {0.001, {0.003, kTau_s}}, {0.1, {0.3, 0.7}}};
  world.profile = ErrorProfile::poses();
  world.profile.position_m = world.profile.angle_rad = 0.0005;
  world.profile.wander_px = {0.05, 0.7};
  world.learns = false;
  EXPECT_LT(meanOf(world).coverage, 0.5);
  world.learns = true;
  EXPECT_GE(meanOf(world).coverage, 0.85);
}

TEST(NoiseLearner, keepsTheProfileWithoutEvidence) {
  SharedErrorFilterOptions options;
  options.errors = ErrorProfile::poses();
  NoiseLearner learner(8, options, 0.5);
  const SharedErrorFilter estimator(8);
  for (int k = 0; k < 100; ++k) {
    learner.observe(Motion::fromTwist({}, kPeriod_s), {{0, {0, 0, 0.001}}}, estimator);
  }
  EXPECT_FALSE(learner.isLearnt());
  EXPECT_EQ(learner.noise().position_m.white, ErrorProfile::poses().position_m);
  EXPECT_EQ(learner.noise().pixel_px.lasting.sigma, ErrorProfile::poses().wander_px.sigma);
  EXPECT_EQ(learner.pixelFactor(), 1);
}

TEST(SharedErrorFilter, isLessSureOnceThereIsMoreNoise) {
  for (const std::size_t places : {std::size_t{0}, std::size_t{1}}) {
    SharedErrorFilterOptions options;
    options.errors = ErrorProfile::poses();
    options.places = places;
    SharedErrorFilter filter(1, options, DepthPrior{1});
    MotionBuffer motion(100);
    motion.push(0, {{0.2, 0, 0}, {0, 0, 0}});
    motion.holdUntil(2);
    for (int k = 0; k < 30; ++k) {
      filter.advance(motion, k * kPeriod_s);
      filter.correct({{0, {-0.2 * k * kPeriod_s, 0, 0.0002}}});
    }
    const double before = filter.estimate(0).sigma_chi;
    MeasurementNoise noise = MeasurementNoise::of(options.errors);
    filter.setNoise(noise);
    EXPECT_NEAR(filter.estimate(0).sigma_chi, before, 1e-9);
    noise.position_m.white *= 0.5;
    filter.setNoise(noise);
    EXPECT_NEAR(filter.estimate(0).sigma_chi, before, 1e-9);
    noise.position_m.white *= 8;
    noise.angle_rad.white *= 4;
    noise.pixel_px.lasting.sigma *= 4;
    filter.setNoise(noise);
    EXPECT_GT(filter.estimate(0).sigma_chi, 3 * before);
    EXPECT_LT(filter.estimate(0).sigma_chi, 4.1 * before);
  }
}

}  // namespace
}  // namespace depthservo
