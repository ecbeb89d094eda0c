#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "depthservo/depth/ObjectDepthObserver.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::StillPoint;

constexpr double kSigma = 0.5 / 600;
constexpr double kDt = 1. / 30;

Twist sideways(double t) { return {{.1 * std::cos(t), .05, 0}, {0, 0, 0}}; }
Twist general(double t) { return {{.1 * std::cos(t), .05, .08}, {.05, -.1 * std::sin(t), .2}}; }

/// A facing plate of four dots, seen by a moving camera.
class Plate {
 public:
  explicit Plate(Twist (*twistAt)(double), double Z = 1) : twistAt_(twistAt) {
    for (double x : {-.1, .1}) {
      for (double y : {-.1, .1}) dots_.emplace_back(Eigen::Vector3d(x * Z, y * Z, Z));
    }
  }

  /// Moves on by a frame and hands over what is seen; `hidden` ids are left out.
  void frame(PointSetEstimator& estimator, const std::set<int>& hidden = {}) {
    if (frames_ > 0) {
      const double t = (frames_ - 1) * kDt;
      for (int i = 0; i < 4; ++i) {  // fine rows, each what holds in its middle
        odometry_.push(t + i * kDt / 4, twistAt_(t + (i + .5) * kDt / 4));
      }
      odometry_.holdUntil(t + kDt);
      for (StillPoint& dot : dots_) dot.move(twistAt_, t, t + kDt);
    }
    ASSERT_EQ(estimator.advance(odometry_, frames_ * kDt), Coverage::complete);
    ++frames_;
    std::vector<PointObservation> seen;
    for (int i = 0; i < 4; ++i) {
      if (!hidden.count(i)) seen.push_back({i, dot(i).measured(kSigma)});
    }
    estimator.correct(seen);
  }

  const StillPoint& dot(int i) const { return dots_[static_cast<std::size_t>(i)]; }
  double meanChi() const {
    double sum = 0;
    for (const StillPoint& dot : dots_) sum += dot.chi();
    return sum / 4;
  }

 private:
  Twist (*twistAt_)(double);
  std::vector<StillPoint> dots_;
  MotionBuffer odometry_{4096};
  int frames_ = 0;
};

TEST(ObjectDepthObserver, ofOnePointIsTheNonlinearObserver) {
  ObjectDepthObserver object(1, {}, {3});
  NonlinearDepthObserver bare;
  StillPoint point = StillPoint::at(.1, -.1, 1);
  MotionBuffer odometry;
  for (int i = 0; i < 150; ++i) {
    const double t = (i - 1) * kDt;
    if (i > 0) {
      odometry.push(t, sideways(t));
      odometry.holdUntil(t + kDt);
      point.move(sideways(t), kDt);
      bare.predict(Motion::fromTwist(sideways(t), kDt));
    }
    ASSERT_EQ(object.advance(odometry, t + kDt), Coverage::complete);
    const bool isHidden = i > 40 && i < 50;
    if (!isHidden) {
      object.correct({{7, point.measured(kSigma)}});
      i == 0 ? bare.reset(point.measured(kSigma), {3}) : bare.correct(point.measured(kSigma));
    } else {
      object.correct({});
    }
    ASSERT_NEAR(object.estimate(7).chi, bare.estimate().chi, 1e-12) << i;
    ASSERT_NEAR(object.estimate(7).x, bare.estimate().x, 1e-12) << i;
    ASSERT_NEAR(object.estimate(7).sigma_chi, bare.estimate().sigma_chi, 1e-9) << i;
    ASSERT_EQ(object.estimate(7).status, bare.estimate().status) << i;
  }
  EXPECT_NEAR(object.estimate(7).Z(), point.Z(), 1e-3);
}

TEST(ObjectDepthObserver, findsTheDepthFromAnyGuess) {
  for (double guess : {0.2, 0.5, 2., 5., 50.}) {
    ObjectDepthObserver object(4, {}, {guess});
    Plate plate(general);
    for (int k = 0; k < 150; ++k) plate.frame(object);
    const DepthEstimate estimate = object.estimate(0);
    EXPECT_NEAR(estimate.chi / plate.meanChi(), 1, 0.01) << "guess " << guess;
    EXPECT_EQ(estimate.status, DepthStatus::valid);
  }
}

TEST(ObjectDepthObserver, allPointsHaveTheSameDepthAlways) {
  ObjectDepthObserver object(4, {}, {3});
  Plate plate(general);
  for (int k = 0; k < 60; ++k) {
    plate.frame(object, k % 7 == 3 ? std::set<int>{1, 2} : std::set<int>{});
    for (int i = 1; i < 4; ++i) ASSERT_EQ(object.estimate(i).chi, object.estimate(0).chi);
  }
}

TEST(ObjectDepthObserver, gainsDoNotDependOnTheNumberOfPoints) {
  ObjectDepthObserver one(1, {}, {3}), four(4, {}, {3});
  Plate ofOne(sideways), ofFour(sideways);
  for (int k = 0; k < 60; ++k) {
    ofOne.frame(one, {1, 2, 3});
    ofFour.frame(four);
    ASSERT_NEAR(one.estimate(0).chi, four.estimate(0).chi, 1e-12) << k;
  }
}

TEST(ObjectDepthObserver, hiddenPointStaysOnTargetWhileTheOthersLearn) {
  ObjectDepthObserver object(4, {}, {2});
  Plate plate(general);
  for (int k = 0; k < 3; ++k) plate.frame(object);
  for (int k = 0; k < 40; ++k) plate.frame(object, {0});
  EXPECT_EQ(object.estimate(0).status, DepthStatus::coasting);
  EXPECT_EQ(object.estimate(1).status, DepthStatus::valid);
  // At its first depth, twice the true one, it would be 0.06 off.
  EXPECT_NEAR(object.estimate(0).x, plate.dot(0).x(), 3e-3);
  EXPECT_NEAR(object.estimate(0).y, plate.dot(0).y(), 3e-3);
  plate.frame(object);
  EXPECT_EQ(object.estimate(0).status, DepthStatus::valid);
}

TEST(ObjectDepthObserver, pointThatJumpsIsRejectedAndDoesNotDisturbTheDepth) {
  ObjectDepthObserver clean(4, {}, {1}), disturbed(4, {}, {1});
  Plate first(general), second(general);
  for (int k = 0; k < 60; ++k) {
    first.frame(clean);
    second.frame(disturbed);
  }
  first.frame(clean, {2});
  second.frame(disturbed, {2});
  disturbed.correct({{2, {second.dot(2).x() + .1, second.dot(2).y(), kSigma}}});
  EXPECT_EQ(disturbed.estimate(2).status, DepthStatus::rejected);
  EXPECT_EQ(disturbed.estimate(2).chi, clean.estimate(2).chi);
}

TEST(ObjectDepthObserver, priorOfAMeasuredPointStartsTheDepthAnewThatOfANewOneDoesNot) {
  ObjectDepthObserver object(4, {}, {1});
  Plate plate(general);
  for (int k = 0; k < 60; ++k) plate.frame(object, {3});
  const double known = object.estimate(0).chi;
  EXPECT_TRUE(object.setPrior(3, {20}));
  EXPECT_EQ(object.estimate(0).chi, known);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(object.setPrior(i, {4}));
  EXPECT_DOUBLE_EQ(object.estimate(0).Z(), 4);
  plate.frame(object);
  EXPECT_EQ(object.estimate(0).status, DepthStatus::unexcited) << "nothing learnt yet";
  for (int k = 0; k < 100; ++k) plate.frame(object);
  EXPECT_NEAR(object.estimate(0).chi / plate.meanChi(), 1, 0.01);
}

TEST(ObjectDepthObserver, withoutTranslationKeepsItsDepthAndSaysSo) {
  const auto turning = [](double t) { return Twist{{0, 0, 0}, {.1, .2 * std::cos(t), .3}}; };
  ObjectDepthObserver object(4, {}, {2.5});
  Plate plate(turning);
  for (int k = 0; k < 90; ++k) plate.frame(object);
  EXPECT_EQ(object.estimate(0).status, DepthStatus::unexcited);
  EXPECT_NEAR(object.estimate(0).Z() * plate.meanChi(), 2.5, 0.05);
}

TEST(ObjectDepthObserver, followsTheDepthOfASlantedPlateOnAverage) {
  ObjectDepthObserver object(2, {}, {3});
  std::vector<StillPoint> points{StillPoint::at(-.1, 0, .9), StillPoint::at(.1, 0, 1.1)};
  MotionBuffer odometry;
  for (int k = 0; k < 120; ++k) {
    const double t = (k - 1) * kDt;
    if (k > 0) {
      odometry.push(t, sideways(t));
      odometry.holdUntil(t + kDt);
      for (StillPoint& p : points) p.move(sideways(t), kDt);
    }
    object.advance(odometry, t + kDt);
    object.correct({{0, points[0].measured(kSigma)}, {1, points[1].measured(kSigma)}});
  }
  EXPECT_NEAR(object.estimate(0).chi, (1 / .9 + 1 / 1.1) / 2, 0.005);
}

TEST(ObjectDepthObserver, depthBeyondItsRangeIsHeldAtItsEndAndNotCalledValid) {
  for (const DepthRange& range : {DepthRange{0.1, 0.8}, DepthRange{2, 20}}) {
    ObjectDepthObserver observer(4, {}, {std::sqrt(range.Z_min * range.Z_max)}, range);
    Plate plate(sideways);
    for (int i = 0; i < 90; ++i) plate.frame(observer);
    const DepthEstimate e = observer.estimate(0);
    EXPECT_NEAR(e.Z(), range.Z_max < 1 ? range.Z_max : range.Z_min, 1e-9);
    EXPECT_EQ(e.status, DepthStatus::converging) << "held there, not found";
    EXPECT_LT(e.sigma_chi, kValidRelativeSigma * e.chi) << "or the test says nothing";
  }
}

TEST(ObjectDepthObserver, ignoresAndCountsPointsBeyondItsCapacity) {
  ObjectDepthObserver object(2);
  Plate plate(general);
  plate.frame(object);
  EXPECT_EQ(object.ignored(), 2u);
  EXPECT_EQ(object.estimate(3).status, DepthStatus::unset);
  EXPECT_FALSE(object.setPrior(9, {1}));
}

TEST(ObjectDepthObserver, odometryThatStartsLaterStartsThePointsAnewWithTheDepth) {
  ObjectDepthObserver object(4, {}, {1});
  Plate plate(general);
  for (int k = 0; k < 60; ++k) plate.frame(object);
  const double known = object.estimate(0).chi;
  MotionBuffer later;
  later.push(100, {});
  EXPECT_EQ(object.advance(later, 100), Coverage::beforeStart);
  EXPECT_EQ(object.estimate(0).status, DepthStatus::unset);
  EXPECT_EQ(object.estimate(0).chi, known);
  object.correct({{0, {.1, .1, kSigma}}});
  EXPECT_EQ(object.estimate(0).chi, known);
  EXPECT_EQ(object.estimate(0).x, .1);
}

TEST(ObjectDepthObserver, fusesADepthOfAKnownPointOnly) {
  ObjectDepthObserver object(4, {}, {1});
  Plate plate(general, 2);
  plate.frame(object);
  object.correctDepth(9, {2, .001});
  EXPECT_DOUBLE_EQ(object.estimate(0).Z(), 1);
  object.correctDepth(1, {2, .001});
  EXPECT_NEAR(object.estimate(0).Z(), 2, 0.01) << "all have the depth of one";
  EXPECT_LT(object.estimate(0).sigma_chi, .0011);
}

TEST(ObjectDepthObserver, cloneIsIndependentAndResetForgets) {
  ObjectDepthObserver object(4, {}, {3});
  Plate plate(general);
  for (int k = 0; k < 60; ++k) plate.frame(object);
  const auto copy = object.clone();
  const double known = object.estimate(0).chi;
  object.reset();
  EXPECT_EQ(object.estimate(0).status, DepthStatus::unset);
  EXPECT_DOUBLE_EQ(object.estimate(0).Z(), 3);
  EXPECT_EQ(copy->estimate(0).chi, known);
}

}  // namespace
}  // namespace depthservo
