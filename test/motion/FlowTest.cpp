#include <gtest/gtest.h>
#include <visp3/visual_features/vpFeaturePoint.h>

#include <cmath>
#include <limits>

#include "depthservo/motion/Flow.h"
#include "depthservo/visp/using.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::Random;
using test::StillPoint;

Eigen::Vector3d vector(const PointState& p) { return {p.x, p.y, p.chi}; }
PointState state(const Eigen::Vector3d& s) { return {s.x(), s.y(), s.z()}; }

PointState project(const Eigen::Vector3d& cP) {
  return {cP.x() / cP.z(), cP.y() / cP.z(), 1 / cP.z()};
}

TEST(Flow, isTheProjectionOfTheMovedPoint) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Twist twist = random.twist(0.4, 0.8);
    StillPoint point = StillPoint::at(random.uniform(-.4, .4), random.uniform(-.4, .4), 2);
    const PointState before = project(point.cP());
    const double dt = random.uniform(0.01, 0.5);
    point.move(twist, dt);
    const Flow after = flow(Motion::fromTwist(twist, dt), before);
    ASSERT_TRUE(after.ahead);
    EXPECT_MATRIX_NEAR(vector(after.point), vector(project(point.cP())), 1e-12);
  }
}

TEST(Flow, forwardThenBackIsWhereItBegan) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Motion motion = Motion::fromTwist(random.twist(0.5, 1), random.uniform(0.01, 1));
    const PointState start{random.uniform(-.5, .5), random.uniform(-.5, .5),
                           random.uniform(-.5, .5)};
    const Flow there = flow(motion, start);
    if (!there.ahead) continue;
    const Flow back = flow(motion.inverse(), there.point);
    ASSERT_TRUE(back.ahead);
    EXPECT_MATRIX_NEAR(vector(back.point), vector(start), 1e-13);
  }
}

TEST(Flow, atInfiniteDepthOnlyRotates) {
  const Twist turn{{0, 0, 0}, {0.1, -0.2, 0.3}};
  const Twist turnAndMove{{5, -3, 8}, turn.angular};
  const PointState far{0.1, 0.2, 0};
  const Flow turned = flow(Motion::fromTwist(turn, 1), far);
  const Flow moved = flow(Motion::fromTwist(turnAndMove, 1), far);
  ASSERT_TRUE(turned.ahead && moved.ahead);
  EXPECT_MATRIX_NEAR(vector(moved.point), vector(turned.point), 1e-15);
  EXPECT_EQ(moved.point.chi, 0);
}

TEST(Flow, isSmoothThroughInfiniteDepth) {
  const Motion motion = Motion::fromTwist({{.3, -.2, .4}, {.1, -.2, .3}}, 0.5);
  const auto at = [&](double chi) { return vector(flow(motion, {0.1, 0.2, chi}).point); };
  const double h = 1e-4;
  const Eigen::Vector3d left = (at(0) - at(-h)) / h, right = (at(h) - at(0)) / h;
  EXPECT_MATRIX_NEAR(left, right, 1e-3 * h / 1e-4);
}

TEST(Flow, ofANegativeInverseDepthIsThatOfTheLineThroughIt) {
  // (x, y, chi < 0) stands for the point m / chi behind the camera; the motion is still rigid.
  const Motion motion = Motion::fromTwist({{.1, -.2, .3}, {.1, -.2, .1}}, 0.5);
  const PointState before{0.1, -0.2, -0.5};
  const Eigen::Vector3d cP = Eigen::Vector3d(before.x, before.y, 1) / before.chi;
  const Flow after = flow(motion, before);
  ASSERT_TRUE(after.ahead);
  EXPECT_MATRIX_NEAR(vector(after.point), vector(project(motion.R * cP + motion.t)), 1e-14);
}

TEST(Flow, refusesAPointThatPassesBehindTheCamera) {
  const PointState near{0.05, -0.02, 2};  // 0.5 m ahead
  const auto advance = [](double distance) {
    return Motion::fromTwist({{0, 0, distance}, {0, 0, 0}}, 1);
  };
  EXPECT_TRUE(flow(advance(0.49), near).ahead);
  for (double distance : {0.5, 0.51, 5.0}) {
    const Flow behind = flow(advance(distance), near);
    EXPECT_FALSE(behind.ahead) << distance;
    EXPECT_EQ(vector(behind.point), vector(near)) << "must stay unchanged";
  }
  EXPECT_FALSE(flow(Motion::fromTwist({{0, 0, 0}, {0, 3, 0}}, 1), near).ahead) << "turned away";
}

TEST(Flow, refusesWhatIsNotFinite) {
  const PointState point{0.1, 0.2, 1};
  const Motion still;
  for (double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    EXPECT_FALSE(flow(still, {bad, 0, 1}).ahead);
    EXPECT_FALSE(flow(still, {0, bad, 1}).ahead);
    EXPECT_FALSE(flow(still, {0, 0, bad}).ahead);
    EXPECT_FALSE(flow(Motion::fromTwist({{bad, 0, 0}, {0, 0, 0}}, 1), point).ahead);
  }
}

TEST(FlowJacobian, isThatOfCentralFiniteDifferences) {
  Random random(3);
  const double h = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const Motion motion = Motion::fromTwist(random.twist(0.3, 0.6), 0.5);
    const Eigen::Vector3d s(random.uniform(-.4, .4), random.uniform(-.4, .4),
                            random.uniform(-.2, 2));
    const Flow after = flow(motion, state(s));
    ASSERT_TRUE(after.ahead);
    Eigen::Matrix3d J_after_before;
    for (int column = 0; column < 3; ++column) {
      const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(column);
      J_after_before.col(column) = (vector(flow(motion, state(s + step)).point) -
                                    vector(flow(motion, state(s - step)).point)) /
                                   (2 * h);
    }
    EXPECT_MATRIX_NEAR(flowJacobian(motion, state(s), after.point), J_after_before, 1e-8);
  }
}

TEST(Flow, ofAnInstantIsTheInteractionMatrix) {
  Random random(4);
  const double h = 1e-5;  // s
  for (int i = 0; i < 50; ++i) {
    const PointState p{random.uniform(-.5, .5), random.uniform(-.5, .5), random.uniform(.2, 5)};
    vpFeaturePoint feature;
    feature.buildFrom(p.x, p.y, 1 / p.chi);
    const vpMatrix L = feature.interaction();
    for (int column = 0; column < 6; ++column) {
      Twist unit;
      (column < 3 ? unit.linear : unit.angular)[column % 3] = 1;
      const Eigen::Vector3d rate = (vector(flow(Motion::fromTwist(unit, h), p).point) -
                                    vector(flow(Motion::fromTwist(unit, -h), p).point)) /
                                   (2 * h);
      const double chiRate = p.chi * p.chi * unit.linear.z() +
                             p.chi * (p.y * unit.angular.x() - p.x * unit.angular.y());
      EXPECT_MATRIX_NEAR(rate, Eigen::Vector3d(L[0][column], L[1][column], chiRate),
                         1e-7 * (1 + p.chi * p.chi));
    }
  }
}

}  // namespace
}  // namespace depthservo
