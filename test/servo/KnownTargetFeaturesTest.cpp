// A known target behind ViSP features, in a loop as a ViSP user writes it.
#include <gtest/gtest.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/vs/vpServo.h>

#include <cmath>
#include <vector>

#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

constexpr double kT = 1. / 30;
const std::vector<Eigen::Vector3d> kPlate{{-.1, -.1, 0}, {.1, -.1, 0}, {.1, .1, 0}, {-.1, .1, 0}};

vpPoint seen(std::size_t i, const vpHomogeneousMatrix& cMo) {
  vpPoint point(kPlate[i].x(), kPlate[i].y(), kPlate[i].z());
  point.track(cMo);
  return point;
}

vpColVector targetTwist(double t) {
  vpColVector v(6, 0.);
  v[0] = .08 * std::cos(t);
  v[2] = .06 * std::sin(.7 * t);
  v[4] = .2 * std::cos(.8 * t);
  return v;
}

VisualMotionObserverOptions fast() {
  VisualMotionObserverOptions options;
  options.ke = 15;
  return options;
}

TEST(KnownTargetFeatures, servo_follows_a_moving_target_with_the_right_depths) {
  const vpCameraParameters cam(600, 600, 320, 240);
  vpHomogeneousMatrix cMo(.1, -.05, 1.2, .1, -.3, .4);
  FeaturePointGroup s(KnownTargetEstimator(kPlate, fast()), kPlate.size());
  std::vector<vpFeaturePoint> s_star(kPlate.size());
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(2);
  for (std::size_t i = 0; i < kPlate.size(); ++i) {
    vpPoint goal = seen(i, vpHomogeneousMatrix(0, 0, .6, 0, 0, 0));
    vpFeatureBuilder::create(s_star[i], goal);
    task.addFeature(s[i], s_star[i]);
  }
  vpColVector v(6, 0.);
  for (int k = 0; k < 450; ++k) {
    for (std::size_t i = 0; i < kPlate.size(); ++i) {
      const vpPoint point = seen(i, cMo);
      vpFeatureBuilder::create(s[i], cam,
                               vpImagePoint(240 + 600 * point.get_y(), 320 + 600 * point.get_x()));
    }
    s.observe(v, kT);
    v = task.computeControlLaw();
    for (std::size_t i = 0; i < kPlate.size(); ++i) {
      ASSERT_NEAR(s[i].get_Z(), seen(i, cMo).get_Z(), .02 * seen(i, cMo).get_Z()) << k;
    }
    cMo = vpExponentialMap::direct(v, kT).inverse() * cMo *
          vpExponentialMap::direct(targetTwist(k * kT), kT);
  }
  EXPECT_LT(task.getError().frobeniusNorm(), .25) << "it keeps up with the target";
}

/// Images that come two frames late: the features are where the target is now.
TEST(KnownTargetFeatures, late_images_are_handed_on_as_the_moving_target_is_now) {
  constexpr int kLate = 2;
  MotionBuffer odometry(1024);
  odometry.push(0, {});
  odometry.holdUntil(100);
  FeaturePointGroup s(KnownTargetEstimator(kPlate, fast()), kPlate.size());
  const auto poseAt = [](double t) {
    return vpHomogeneousMatrix(-.3 + .3 * t, 0, 1 + .2 * t, 0, .3, 0);
  };
  for (int k = 0; k < 40; ++k) {
    const double exposure = k * kT, now = exposure + kLate * kT;
    for (std::size_t i = 0; i < kPlate.size(); ++i) {
      s[i].set_x(seen(i, poseAt(exposure)).get_x());
      s[i].set_y(seen(i, poseAt(exposure)).get_y());
    }
    ASSERT_EQ(s.observe(odometry, exposure, now), Coverage::complete);
    if (k < 20) continue;
    for (std::size_t i = 0; i < kPlate.size(); ++i) {
      const double behind = seen(i, poseAt(now)).get_x() - seen(i, poseAt(exposure)).get_x();
      EXPECT_NEAR(s[i].get_x(), seen(i, poseAt(now)).get_x(), .2 * std::abs(behind)) << k;
      EXPECT_NEAR(s[i].get_Z(), seen(i, poseAt(now)).get_Z(), .02) << k;
    }
  }
}

}  // namespace
}  // namespace depthservo
