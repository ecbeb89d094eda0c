#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "support/FourPointScene.h"
#include "support/StillPoint.h"
#include "support/ToldEstimates.h"

namespace depthservo {
namespace {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// Of the estimator that a single FeaturePoint has.
FeaturePointGroup pointwiseGroup(std::size_t n) {
  const InverseDepthFilter one(InverseDepthFilter::Options::considering(ErrorProfile::arm(), 600));
  return FeaturePointGroup(PointwiseEstimator(one, n), n);
}

Twist twistAt(double t) { return {{.1 * std::cos(t), .05, .08}, {.05, -.1 * std::sin(t), .2}}; }

vpColVector vispTwist(const Twist& u) {
  vpColVector v(6);
  for (unsigned j = 0; j < 3; ++j) {
    v[j] = u.linear[j];
    v[j + 3] = u.angular[j];
  }
  return v;
}

void measure(FeaturePoint& s, const StillPoint& p) {
  s.set_x(p.x());
  s.set_y(p.y());
}

TEST(FeaturePointGroup, isTheSameAsItsFeaturesOneByOne) {
  FeaturePointGroup group = pointwiseGroup(3);
  std::vector<FeaturePoint> single(3);
  std::vector<StillPoint> points{StillPoint::at(.1, -.1, 1), StillPoint::at(-.1, .1, 2),
                                 StillPoint::at(.2, .1, .7)};
  for (std::size_t i = 0; i < 3; ++i) {
    group[i].set_Z(1.5 + static_cast<double>(i));
    single[i].set_Z(1.5 + static_cast<double>(i));
    group[i].setServoDepth(ServoDepth::observed);  // in doubt a group has more in common
    single[i].setServoDepth(ServoDepth::observed);
  }
  for (int k = 0; k < 200; ++k) {
    const Twist twist = twistAt(k * kPeriod_s);
    for (std::size_t i = 0; i < 3; ++i) {
      points[i].move(twist, kPeriod_s);
      const bool isHidden = i == 1 && k > 50 && k < 70;
      const bool isJump = i == 0 && k == 100;
      if (isHidden) continue;
      for (FeaturePoint* s : {&group[i], &single[i]}) {
        measure(*s, points[i]);
        if (isJump) s->set_x(2);
        if (i == 2 && k == 120) s->set_Z(3);
      }
    }
    group.observe(vispTwist(twist), kPeriod_s);
    for (FeaturePoint& s : single) s.observe(vispTwist(twist), kPeriod_s);
    for (std::size_t i = 0; i < 3; ++i) {
      // The group's clock rounds dt to 1e-15 s, which is 1e-13 of its parallax.
      ASSERT_NEAR(group[i].estimate().chi, single[i].estimate().chi, 1e-11) << k << ", point " << i;
      ASSERT_NEAR(group[i].estimate().sigma_chi, single[i].estimate().sigma_chi, 1e-11);
      ASSERT_NEAR(group[i].get_x(), single[i].get_x(), 1e-12);
      ASSERT_NEAR(group[i].get_y(), single[i].get_y(), 1e-12);
      ASSERT_NEAR(group[i].get_Z(), single[i].get_Z(), 1e-12);
      ASSERT_EQ(group[i].estimate().status, single[i].estimate().status) << k << ", point " << i;
    }
  }
}

TEST(FeaturePointGroup, servoConvergesFromAnyGuess) {
  for (double guess : {3.0, 0.3, 0.0, -1.0, kNaN, kInf}) {
    FeaturePointGroup s = pointwiseGroup(4);
    for (std::size_t i = 0; i < 4; ++i) s[i].set_Z(guess);
    const ServoOutcome outcome =
        servo(s, vpServo::CURRENT, 400, [&](std::size_t i, const vpColVector& v) {
          if (i == 3) s.observe(v, kPeriod_s);
        });
    EXPECT_LT(outcome.error, 1.5e-3) << guess;
    for (double error : outcome.relativeDepth) EXPECT_LT(std::abs(error), 0.03) << guess;
  }
}

TEST(FeaturePointGroup, observeOfAMemberDoesNothing) {
  FeaturePointGroup s = pointwiseGroup(1);
  s[0].set_x(.1);
  s[0].set_y(.2);
  s[0].observe(vpColVector(6, 0.), kPeriod_s);
  EXPECT_EQ(s[0].estimate().status, DepthStatus::unset);
  s.observe(vpColVector(6, 0.), kPeriod_s);
  EXPECT_NE(s[0].estimate().status, DepthStatus::unset) << "its measurement was not lost";
}

TEST(FeaturePointGroup, countsWhatItRefusesAndGoesOn) {
  FeaturePointGroup s = pointwiseGroup(1);
  StillPoint point = StillPoint::at(.1, .1, 1.3);
  const Twist lateral{{.1, .03, 0}, {0, 0, 0}};
  measure(s[0], point);
  s.observe(vispTwist(lateral), kPeriod_s);
  unsigned refused = 0;
  for (double dt : {0.0, -1.0, kNaN, kInf, 1e300, 1e150}) {
    s.observe(vispTwist(lateral), dt);
    EXPECT_EQ(s[0].refused(), ++refused) << dt;
  }
  s.observe(vpColVector(6, kNaN), kPeriod_s);
  s.observe(vpColVector(4, .1), kPeriod_s);
  EXPECT_EQ(s[0].refused(), refused + 2);
  for (int k = 0; k < 120; ++k) {
    point.move(lateral, kPeriod_s);
    measure(s[0], point);
    s.observe(vispTwist(lateral), kPeriod_s);
  }
  EXPECT_NEAR(s[0].get_Z(), 1.3, 0.03);
}

TEST(FeaturePointGroup, imagesThatArriveLateArePredictedToNow) {
  // Exposed 80 ms before they are handed over; odometry at 100 Hz is at hand until now.
  FeaturePointGroup s = pointwiseGroup(1);
  MotionBuffer odometry;
  StillPoint exposed = StillPoint::at(.1, -.1, 1.2), now = exposed;
  const double delay = 0.08, epoch_s = 1.3e9;
  for (int i = 0; i < 600; ++i) odometry.push(epoch_s + .01 * i, twistAt(.01 * i + .005));
  now.move(twistAt, 0, delay);
  for (int k = 0; k < 120; ++k) {
    const double t = k * kPeriod_s;
    if (k > 0) {
      exposed.move(twistAt, t - kPeriod_s, t);
      now.move(twistAt, t - kPeriod_s + delay, t + delay);
    }
    measure(s[0], exposed);
    ASSERT_EQ(s.observe(odometry, epoch_s + t, epoch_s + t + delay), Coverage::complete);
  }
  EXPECT_NEAR(s[0].get_x(), now.x(), 2e-4);
  EXPECT_NEAR(s[0].get_y(), now.y(), 2e-4);
  EXPECT_NEAR(s[0].get_Z() / now.Z(), 1, 0.02);
  EXPECT_GT(std::hypot(now.x() - exposed.x(), now.y() - exposed.y()), 5e-3) << "it does matter";
}

TEST(FeaturePointGroup, lateOdometryKeepsTheEstimatesAndSaysSo) {
  FeaturePointGroup s = pointwiseGroup(1);
  MotionBuffer odometry;
  odometry.push(0, {{.1, 0, 0}, {0, 0, 0}});
  odometry.push(.1, {{.1, 0, 0}, {0, 0, 0}});
  measure(s[0], StillPoint::at(.1, .1, 1));
  EXPECT_EQ(s.observe(odometry, 0), Coverage::complete);
  const DepthEstimate before = s[0].estimate();
  measure(s[0], StillPoint::at(.05, .1, 1));
  EXPECT_EQ(s.observe(odometry, .4), Coverage::afterEnd);
  EXPECT_EQ(s[0].estimate().chi, before.chi);
  EXPECT_EQ(s[0].estimate().x, before.x);
  EXPECT_EQ(s.observe(odometry, -1), Coverage::reversed);
  EXPECT_EQ(s[0].estimate().chi, before.chi);
}

TEST(FeaturePointGroup, coastsHonestlyWhileTheOdometryIsMissing) {
  // 100 Hz, none from 4 s to 5 s, in which the camera advances at 0.6 m/s instead.
  FeaturePointGroup s = pointwiseGroup(2);
  MotionBuffer odometry;
  std::vector<StillPoint> points{StillPoint::at(.1, -.1, 2), StillPoint::at(-.2, .1, 3)};
  const auto twist = [](double t) {
    return t > 4 && t < 5 ? Twist{{0, 0, .6}, {0, 0, 0}} : Twist{{.15, .05, 0}, {0, .05, .1}};
  };
  double rows_s = 0;
  for (int k = 0; k <= 270; ++k) {
    const double t = k * kPeriod_s;
    for (; rows_s < t; rows_s += .01) {
      if (rows_s < 4 || rows_s > 5 - 1e-9) odometry.push(rows_s, twist(rows_s + .005));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      if (k > 0) points[i].move(twist, t - kPeriod_s, t);
      measure(s[i], points[i]);
    }
    const Coverage coverage = s.observe(odometry, t);
    for (std::size_t i = 0; k > 60 && hasMotion(coverage) && i < 2; ++i) {
      const DepthEstimate& e = s[i].estimate();
      if (t > 4.08 && t < 5) {
        ASSERT_TRUE(coverage == Coverage::ended) << toString(coverage);
        ASSERT_EQ(e.status, DepthStatus::coasting);
        ASSERT_EQ(s[i].get_x(), points[i].x());
      }
      ASSERT_LT(std::abs(e.chi - points[i].chi()), 4 * e.sigma_chi + 1e-3) << t;
    }
  }
  EXPECT_NEAR(odometry.unknownSince(4.5, 4.6), 4, .02);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(s[i].estimate().status, DepthStatus::valid);
    EXPECT_NEAR(s[i].estimate().Z() / points[i].Z(), 1, .02) << "learnt again";
  }
}

TEST(FeaturePointGroup, refusedTwistsWidenSigmaAsForOneFeature) {
  FeaturePointGroup group = pointwiseGroup(1);
  FeaturePoint single;
  StillPoint point = StillPoint::at(.1, -.1, 1.5);
  const Twist lateral{{.15, .03, 0}, {0, 0, 0}};
  for (int k = 0; k < 200; ++k) {
    const bool isRefused = k >= 60 && k < 90;
    point.move(isRefused ? Twist{{0, 0, .3}, {0, 0, 0}} : lateral, kPeriod_s);
    measure(group[0], point);
    measure(single, point);
    const vpColVector v = isRefused ? vpColVector(6, kNaN) : vispTwist(lateral);
    const double dt = isRefused && k % 2 ? 0 : kPeriod_s;
    group.observe(v, dt);
    single.observe(v, dt);
    const DepthEstimate &a = group[0].estimate(), &b = single.estimate();
    ASSERT_EQ(a.status, b.status) << k;
    ASSERT_NEAR(a.chi, b.chi, 1e-9) << k;
    ASSERT_NEAR(a.sigma_chi, b.sigma_chi, 1e-9) << k;
    ASSERT_NEAR(group.unknownFor_s(), single.unknownFor_s(), 1e-12);
    if (isRefused) {
      ASSERT_EQ(a.status, DepthStatus::coasting);
    }
    ASSERT_LT(std::abs(a.chi - point.chi()), 4 * a.sigma_chi) << k;
  }
  EXPECT_EQ(group.refused(), 30u);
  EXPECT_EQ(group[0].refused(), 30u);
  EXPECT_EQ(group[0].estimate().status, DepthStatus::valid);
}

TEST(FeaturePointGroup, imagesFarApartAreNoHole) {
  FeaturePointGroup s = pointwiseGroup(1);
  StillPoint point = StillPoint::at(.1, .1, 1.3);
  const Twist lateral{{.1, .03, 0}, {0, 0, 0}};
  for (int k = 0; k < 90; ++k) {
    const double dt = k % 20 == 19 ? 20 * kPeriod_s : kPeriod_s;  // told, hence known
    point.move(lateral, dt);
    measure(s[0], point);
    s.observe(vispTwist(lateral), dt);
    ASSERT_NE(s[0].estimate().status, DepthStatus::coasting);
  }
  EXPECT_NEAR(s[0].get_Z(), 1.3, 0.03);
}

TEST(FeaturePointGroup, theSameDepthAtEveryImageIsNoNewDepth) {
  FeaturePointGroup s = pointwiseGroup(1);
  StillPoint point = StillPoint::at(.1, .1, 1.3);
  const Twist lateral{{.1, .03, 0}, {0, 0, 0}};
  for (int k = 0; k < 90; ++k) {
    point.move(lateral, kPeriod_s);
    s[0].buildFrom(point.x(), point.y(), 4);
    s.observe(vispTwist(lateral), kPeriod_s);
  }
  EXPECT_NEAR(s[0].estimate().Z(), 1.3, 0.03);
  EXPECT_EQ(s[0].restarts(), 0u);
}

TEST(FeaturePointGroup, depthsInDoubtKeepTheirProportions) {
  const DepthRange range{1e-3, 100};
  FeaturePointGroup s(PointwiseEstimator(InverseDepthFilter({}, range), 3, {}, range), 3);
  const double guesses[] = {.5, 1, 4};
  for (std::size_t i = 0; i < 3; ++i) {
    s[i].set_Z(guesses[i]);
    measure(s[i], StillPoint::at(.1, .1, 1));
  }
  s.observe(vpColVector(6, 0.), kPeriod_s);
  EXPECT_LE(s[2].get_Z(), 1 / (.25 + 2 * DepthPrior::kWideSigma_chi) + 1e-12);
  EXPECT_NEAR(s[2].get_Z() / s[1].get_Z(), 4, 1e-9);
  EXPECT_NEAR(s[1].get_Z() / s[0].get_Z(), 2, 1e-9);
  s[0].setDesiredDepth(.8);
  s[1].setDesiredDepth(.6);
  s.observe(vpColVector(6, 0.), kPeriod_s);
  EXPECT_NEAR(s[2].get_Z(), .7, .02) << "the mean of what is known of the goal";
}

TEST(FeaturePointGroup, servoWithoutADesiredDepthConvergesFromAnyGuess) {
  for (double guess : {.05, .5, 3., 1e6}) {
    FeaturePointGroup s = pointwiseGroup(4);
    FourPointScene scene;
    std::vector<vpFeaturePoint> s_star(4);
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(vpServo::CURRENT);
    task.setLambda(.8);
    for (std::size_t i = 0; i < 4; ++i) {
      s[i].set_Z(guess);
      s_star[i].set_x(scene.desired(i).get_x());
      s_star[i].set_y(scene.desired(i).get_y());
      task.addFeature(s[i], s_star[i]);
    }
    vpColVector v(6, 0.);
    for (int k = 0; k < 600; ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        s[i].set_x(scene.seen(i).get_x());
        s[i].set_y(scene.seen(i).get_y());
      }
      s.observe(v, kPeriod_s);
      v = scene.apply(task.computeControlLaw());
    }
    EXPECT_LT(task.getError().frobeniusNorm(), 1.5e-3) << guess;
  }
}

TEST(FeaturePointGroup, odometryThatStartsLaterStartsAnew) {
  FeaturePointGroup s = pointwiseGroup(1);
  s[0].set_Z(2.5);
  measure(s[0], StillPoint::at(.1, .1, 1));
  MotionBuffer odometry;
  odometry.push(5, {});
  odometry.push(6, {});
  s.observe(odometry, 0);
  measure(s[0], StillPoint::at(.3, .1, 1));
  EXPECT_EQ(s.observe(odometry, 1), Coverage::beforeStart);
  EXPECT_EQ(s[0].get_x(), .3) << "not rejected as a jump";
  EXPECT_NEAR(s[0].estimate().Z(), 2.5, 1e-12);
}

TEST(FeaturePointGroup, setDepthIsFusedIntoThatPoint) {
  FeaturePointGroup s = pointwiseGroup(2);
  for (std::size_t i = 0; i < 2; ++i) measure(s[i], StillPoint::at(.1, .1, 1));
  s.observe(vpColVector(6, 0.), kPeriod_s);
  s.setDepth(1, 2, 1e-3);
  for (double bad : {kNaN, kInf, 0.0, -1.0}) s.setDepth(1, bad, 1e-3);
  for (std::size_t i = 0; i < 2; ++i) measure(s[i], StillPoint::at(.1, .1, 1));
  s.observe(vpColVector(6, 0.), kPeriod_s);
  EXPECT_NEAR(s[0].estimate().Z(), 1, 1e-9);
  EXPECT_NEAR(s[1].estimate().Z(), 2, 1e-3);
}

DepthEstimate toldDepth(double Z, double sigma_chi) {
  DepthEstimate e;
  e.x = e.y = 0.1;
  e.chi = 1 / Z;
  e.sigma_chi = sigma_chi;
  e.status = DepthStatus::converging;
  return e;
}

/// As a corner where two walls overlap in the image, which slides along both.
TEST(PointFeatures, onePointAtTheNearEndDoesNotHoldBackTheOthers) {
  const double Z_min = DepthRange{}.Z_min;
  PointFeatures features(4, DepthRange{});
  const auto depthsWhere = [&](const DepthEstimate& last) {
    const ToldEstimates told({toldDepth(1.4, .02), toldDepth(1.9, .03), toldDepth(2, .03), last});
    features.publish(told, {}, MotionBuffer{}, 0);
    std::vector<double> depths;
    for (std::size_t i = 0; i < 4; ++i) depths.push_back(features[i].get_Z());
    return depths;
  };
  const std::vector<double> depths = depthsWhere(toldDepth(Z_min, 3e4));
  EXPECT_NEAR(depths[0], 1.4, 1e-12);
  EXPECT_NEAR(depths[1], 1.9, 1e-12);
  EXPECT_NEAR(depths[2], 2, 1e-12);
  EXPECT_NEAR(depths[3], 1.9, 1e-12) << "the median of those that are found";
  features[3].setServoDepth(ServoDepth::observed);
  EXPECT_NEAR(depthsWhere(toldDepth(Z_min, 3e4))[3], 1.9, 1e-12) << "it is not observed";
  features[3].setServoDepth(ServoDepth::blended);

  EXPECT_NEAR(depthsWhere(toldDepth(Z_min, 5))[3], 1.9, 1e-12) << "however sure it seems";
  EXPECT_LT(depthsWhere(toldDepth(1, 5))[0], 1.3) << "in doubt, but a depth: all are cautious";
}

TEST(PointFeatures, whereNoneIsFoundAllAreCautious) {
  PointFeatures features(2, DepthRange{});
  features.publish(ToldEstimates({toldDepth(DepthRange{}.Z_min, 3e4), toldDepth(2, 3)}), {},
                   MotionBuffer{}, 0);
  EXPECT_LT(features[0].get_Z(), 0.051);
  EXPECT_LT(features[1].get_Z(), 0.3);
}

}  // namespace
}  // namespace depthservo
