#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "depthservo/tracking/KnownTargetEstimator.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;
using Options = VisualMotionObserverOptions;
using Points = std::vector<Eigen::Vector3d>;

constexpr double kT = 1. / 30, kSigma = .3 / 600;
const Points kPlate{{-.1, -.1, 0}, {.1, -.1, 0}, {.1, .1, 0}, {-.1, .1, 0}};
const Points kBox{{.1, .1, 0},  {-.1, .1, 0}, {-.1, -.1, 0},
                  {.1, -.1, 0}, {0, .1, .1},  {0, -.1, .1}};

Eigen::Isometry3d poseOf(const Eigen::Vector3d& position, const Eigen::Vector3d& turn) {
  Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
  g.translation() = position;
  if (turn.norm() > 0) g.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
  return g;
}

std::vector<PointObservation> seen(const Points& points, const Eigen::Isometry3d& cMo,
                                   double sigma = 0, Random* noise = nullptr) {
  std::vector<PointObservation> image;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d cP = cMo * points[i];
    const double dx = noise ? noise->normal(sigma) : 0, dy = noise ? noise->normal(sigma) : 0;
    image.push_back({static_cast<int>(i), {cP.x() / cP.z() + dx, cP.y() / cP.z() + dy, sigma}});
  }
  return image;
}

double angleBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

/// A camera at rest; the target is wherever the test puts it.
struct Watch {
  Points points;
  KnownTargetEstimator estimator;
  MotionBuffer odometry = MotionBuffer(4096);
  double time_s = 0;

  explicit Watch(const Points& target, const Options& options = {})
      : points(target), estimator(target, options) {
    odometry.push(0, {});
    odometry.holdUntil(1e3);
  }
  void see(const std::vector<PointObservation>& image) {
    estimator.advance(odometry, time_s);
    estimator.correct(image);
    time_s += kT;
  }
  DepthStatus status() const { return estimator.estimate(0).status; }
};

TEST(KnownTarget, isFoundInTheFirstImageWhateverItsOrientation) {
  Random random(1);
  for (const Points& points : {kPlate, kBox}) {
    for (int trial = 0; trial < 300; ++trial) {
      const double tilt = 1.2 * random.uniform(0, 1), towards = 2 * M_PI * random.uniform(0, 1);
      const Eigen::Isometry3d cMo =
          poseOf({.3 * random.uniform(-1, 1), .3 * random.uniform(-1, 1), .8},
                 tilt * Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)) *
          poseOf({0, 0, 0}, {0, 0, 2 * M_PI * random.uniform(0, 1)});
      Watch watch(points);
      watch.see(seen(points, cMo));
      ASSERT_LT(angleBetween(watch.estimator.observer().cMo(), cMo), 1e-5) << "tilted by " << tilt;
      for (int id = 0; id < 4; ++id) {
        const double Z = (cMo * points[static_cast<std::size_t>(id)]).z();
        ASSERT_NEAR(watch.estimator.estimate(id).Z(), Z, 1e-6);
      }
      ASSERT_EQ(watch.status(), DepthStatus::valid);
    }
  }
}

TEST(KnownTarget, isFoundAgainWhenItTurnedUnseen) {
  Watch watch(kPlate);
  const Eigen::Isometry3d before = poseOf({0, 0, .8}, {0, .4, 0});
  const Eigen::Isometry3d after = before * poseOf({0, 0, 0}, {0, 0, 2});
  for (int k = 0; k < 30; ++k) watch.see(seen(kPlate, before));
  EXPECT_EQ(watch.estimator.starts(), 1);
  for (int k = 0; k < 10; ++k) watch.see(seen(kPlate, after));
  EXPECT_EQ(watch.estimator.starts(), 2);
  EXPECT_LT(angleBetween(watch.estimator.observer().cMo(), after), 1e-6);
  EXPECT_EQ(watch.status(), DepthStatus::valid);
}

TEST(KnownTarget, goesOnFromItsPredictionAfterAGap) {
  Watch watch(kPlate);
  const Eigen::Isometry3d cMo = poseOf({0, 0, .8}, {.3, .4, 0});
  watch.see(seen(kPlate, cMo));
  for (int k = 0; k < 30; ++k) watch.see({});
  EXPECT_EQ(watch.status(), DepthStatus::coasting);
  watch.see(seen(kPlate, cMo));
  EXPECT_EQ(watch.status(), DepthStatus::valid);
  EXPECT_EQ(watch.estimator.starts(), 1);
}

/// A small flat target far away, tilted: its mirrored tilt explains the first image almost as well.
TEST(KnownTarget, mirroredTiltIsGivenUpWhenTheImagesTellIt) {
  int ambiguous = 0, wrongStarts = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Random noise(seed);
    Watch watch(kPlate);
    const auto poseAt = [](int k) { return poseOf({0, 0, 3.5 - .015 * k}, {.35, .25, 0}); };
    for (int k = 0; k < 200; ++k) {
      watch.see(seen(kPlate, poseAt(k), 3 * kSigma, &noise));
      if (k > 0) continue;
      ambiguous += watch.estimator.isAmbiguous();
      wrongStarts += angleBetween(watch.estimator.observer().cMo(), poseAt(0)) > .5;
    }
    EXPECT_FALSE(watch.estimator.isAmbiguous()) << seed;
    EXPECT_LT(angleBetween(watch.estimator.observer().cMo(), poseAt(199)), .15) << seed;
  }
  EXPECT_GT(ambiguous, 20) << "the test must be hard";
  EXPECT_GT(wrongStarts, 5) << "the test must be hard";
}

TEST(KnownTarget, sigmaCoversBothPosesWhileTheyAreNotTold) {
  int within = 0, all = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Random noise(seed);
    Watch watch(kPlate);
    const Eigen::Isometry3d cMo = poseOf({0, 0, 2.5}, {.35, .25, 0});
    for (int k = 0; k < 5; ++k) watch.see(seen(kPlate, cMo, kSigma, &noise));
    for (int id = 0; id < 4; ++id) {
      const DepthEstimate e = watch.estimator.estimate(id);
      const double chi = 1 / (cMo * kPlate[static_cast<std::size_t>(id)]).z();
      within += std::abs(e.chi - chi) < 2 * e.sigma_chi;
      ++all;
    }
  }
  EXPECT_GT(within, 0.9 * all);
}

TEST(KnownTarget, refusesWhatIsNone) {
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Points> bad{{},
                                {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {5, 5, 5}},
                                {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                                {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, kNaN, 0}}};
  for (const Points& points : bad) {
    EXPECT_TRUE(whyNoTarget(points));
    EXPECT_THROW(KnownTargetEstimator{points}, std::invalid_argument);
  }
  EXPECT_FALSE(whyNoTarget(kPlate));
}

TEST(KnownTarget, imagesThatShowNoPoseDoNotStartIt) {
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Isometry3d cMo = poseOf({0, 0, .8}, {.3, .4, 0});
  auto three = seen(kPlate, cMo);
  three.pop_back();
  auto notANumber = seen(kPlate, cMo);
  notANumber[1].measurement.x = kNaN;
  auto onALine = seen(kPlate, cMo);
  for (auto& point : onALine) point.measurement.y = 0;
  auto onePlace = seen(kPlate, cMo);
  for (auto& point : onePlace) point.measurement.x = point.measurement.y = .1;
  for (const auto& image :
       {std::vector<PointObservation>{}, three, notANumber, onALine, onePlace}) {
    Watch watch(kPlate);
    for (int k = 0; k < 3; ++k) watch.see(image);
    EXPECT_NE(watch.status(), DepthStatus::valid);
    EXPECT_NE(watch.status(), DepthStatus::converging);
    EXPECT_TRUE(std::isfinite(watch.estimator.estimate(0).Z()));
    watch.see(seen(kPlate, cMo));
    EXPECT_EQ(watch.status(), DepthStatus::valid) << "and it recovers";
  }
}

/// The prediction to a later time goes on with the target.
TEST(KnownTarget, movingTargetIsMetWhereItWillBe) {
  Options options;
  options.ke = 15;
  Watch watch(kPlate, options);
  const auto poseAt = [](double t) { return poseOf({-.3 + .4 * t, 0, 1 + .3 * t}, {0, .3, 0}); };
  for (int k = 0; k < 30; ++k) watch.see(seen(kPlate, poseAt(watch.time_s)));
  const double exposure = watch.time_s - kT, now = exposure + kT;
  const DepthEstimate later = watch.estimator.estimate(0, watch.odometry, now);
  const DepthEstimate then = watch.estimator.estimate(0);
  const Eigen::Vector3d cP = poseAt(now) * kPlate[0];
  EXPECT_LT(std::abs(later.x - cP.x() / cP.z()), .1 * std::abs(then.x - cP.x() / cP.z()));
  EXPECT_NEAR(later.Z() - then.Z(), .3 * kT, .1 * .3 * kT);
}

TEST(KnownTarget, resetForgetsAndClonesAreIndependent) {
  Watch watch(kPlate);
  const Eigen::Isometry3d cMo = poseOf({0, 0, .8}, {.3, .4, 0});
  watch.see(seen(kPlate, cMo));
  const auto clone = watch.estimator.clone();
  watch.estimator.reset();
  EXPECT_EQ(watch.status(), DepthStatus::unset);
  EXPECT_EQ(clone->estimate(0).status, DepthStatus::valid);
  watch.time_s = 5;
  watch.see(seen(kPlate, cMo));
  EXPECT_EQ(watch.status(), DepthStatus::valid);
}

}  // namespace
}  // namespace depthservo
