#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/core/vpVelocityTwistMatrix.h>

#include <cmath>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "depthservo/motion/Motion.h"
#include "depthservo/visp/using.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

constexpr double kPi = 3.14159265358979323846;

Eigen::Matrix4d matrix(const Motion& motion) {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() = motion.R;
  M.topRightCorner<3, 1>() = motion.t;
  return M;
}

/// exp(-[u] dt) by Eigen's general matrix exponential (scaling, squaring, Pade). t is linear in v:
/// the reference is computed for a distance of 1 m, where it is accurate, and scaled.
Eigen::Matrix4d matrixExponential(const Twist& u, double dt) {
  const double distance = std::max(u.linear.norm() * dt, 1.0);
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  A.topLeftCorner<3, 3>() << 0, -u.angular.z(), u.angular.y(),  //
      u.angular.z(), 0, -u.angular.x(),                         //
      -u.angular.y(), u.angular.x(), 0;
  A.topRightCorner<3, 1>() = u.linear / distance;
  A *= -dt;
  Eigen::Matrix4d exponential = A.exp();
  exponential.topRightCorner<3, 1>() *= distance;
  return exponential;
}

Twist difference(const Twist& a, const Twist& b) {
  return {a.linear - b.linear, a.angular - b.angular};
}

Eigen::Isometry3d pose(const vpHomogeneousMatrix& M) {
  Eigen::Isometry3d pose;
  for (unsigned i = 0; i < 4; ++i) {
    for (unsigned j = 0; j < 4; ++j) pose.matrix()(i, j) = M[i][j];
  }
  return pose;
}

class MotionAtAngle : public ::testing::TestWithParam<double> {};

TEST_P(MotionAtAngle, isTheMatrixExponential) {
  const double angle = GetParam();
  Random random(1);
  for (double speed : {0.0, 1e-9, 1.0, 50.0}) {
    for (double dt : {1e-6, 1.0 / 30, 2.0, 1000.0}) {
      const Twist twist{speed * random.direction(), angle / dt * random.direction()};
      SCOPED_TRACE(::testing::Message() << "speed " << speed << " m/s, dt " << dt << " s");
      const Motion motion = Motion::fromTwist(twist, dt);
      const double scale = (1 + angle) * (1 + speed * dt);
      EXPECT_MATRIX_NEAR(matrix(motion), matrixExponential(twist, dt), 2e-14 * scale);
      EXPECT_EQ(motion.dt, dt);
      EXPECT_EQ(motion.dt2, dt * dt);
    }
  }
}

TEST_P(MotionAtAngle, isARigidMotion) {
  Random random(2);
  const Motion motion = Motion::fromTwist({random.vector(1), GetParam() * random.direction()}, 1.0);
  EXPECT_MATRIX_NEAR(motion.R * motion.R.transpose(), Eigen::Matrix3d::Identity(), 1e-13);
  EXPECT_NEAR(motion.R.determinant(), 1, 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Angles, MotionAtAngle,
                         ::testing::Values(0.0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3, 0.0499999, 0.0500001,
                                           0.3, 1.0, 3.0, kPi - 1e-6, kPi, kPi + 1e-6, 4.0,
                                           2 * kPi - 1e-9, 2 * kPi, 10.0, 200.0));

class TwistBelowPi : public ::testing::TestWithParam<double> {};

TEST_P(TwistBelowPi, isRecoveredFromItsMotion) {
  const double angle = GetParam();
  // The axis is as good as sin(angle / 2) in the quaternion; near pi, V^-1 is still regular.
  Random random(3);
  for (double dt : {1e-3, 1.0 / 30, 5.0}) {
    for (int i = 0; i < 50; ++i) {
      const Twist twist{random.vector(1), angle / dt * random.direction()};
      const Twist error = difference(Motion::fromTwist(twist, dt).twist(), twist);
      EXPECT_LT(error.linear.norm(), 1e-13 * (1 + 1 / dt) * (1 + angle));
      EXPECT_LT(error.angular.norm(), 1e-14 * (1 + 1 / dt) * (1 + angle));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, TwistBelowPi,
                         ::testing::Values(0.0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3, 0.0499999, 0.0500001,
                                           0.3, 1.0, 3.0, kPi - 1e-3, kPi - 1e-6));

TEST(Motion, beyondPiHasAnotherTwistThatMakesTheSameMotion) {
  Random random(4);
  for (double angle : {kPi + 0.1, 5.0, 8.0, 40.0}) {
    const Motion motion = Motion::fromTwist({random.vector(1), angle * random.direction()}, 1);
    const Motion again = Motion::fromTwist(motion.twist(), 1);
    EXPECT_MATRIX_NEAR(matrix(again), matrix(motion), 1e-12);
  }
}

TEST(Motion, withoutDurationHasNoTwist) {
  Motion motion = Motion::fromTwist({{1, 2, 3}, {.1, .2, .3}}, 1);
  motion.dt = 0;
  EXPECT_EQ(motion.twist().linear, Eigen::Vector3d::Zero());
  EXPECT_EQ(motion.twist().angular, Eigen::Vector3d::Zero());
}

TEST(Motion, ofACameraThatAdvancesBringsThePointNearer) {
  const Motion motion = Motion::fromTwist({{0, 0, 0.5}, {0, 0, 0}}, 2);
  EXPECT_MATRIX_NEAR(motion.t, Eigen::Vector3d(0, 0, -1), 0);
}

TEST(Motion, isTheInverseOfVispsExponentialMap) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Twist u = random.twist(0.5, 1.5);
    const double dt = random.uniform(1e-3, 1);
    vpColVector v(6);
    for (unsigned j = 0; j < 3; ++j) {
      v[j] = u.linear[j];
      v[j + 3] = u.angular[j];
    }
    const vpHomogeneousMatrix expected = vpExponentialMap::direct(v, dt).inverse();
    EXPECT_MATRIX_NEAR(matrix(Motion::fromTwist(u, dt)), pose(expected).matrix(), 1e-13);
  }
}

TEST(Motion, fromPosesIsThatOfTheTwistBetweenThem) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    vpColVector v(6), start(6);
    for (unsigned j = 0; j < 6; ++j) {
      v[j] = random.uniform(-1, 1);
      start[j] = random.uniform(-2, 2);
    }
    const double dt = random.uniform(1e-3, 1);
    const vpHomogeneousMatrix wMc = vpExponentialMap::direct(start, 1);
    const vpHomogeneousMatrix wMc_now = wMc * vpExponentialMap::direct(v, dt);
    const Motion motion = Motion::fromPoses(pose(wMc), pose(wMc_now), dt);
    EXPECT_MATRIX_NEAR(matrix(motion),
                       matrixExponential({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}, dt), 1e-13);
    EXPECT_EQ(motion.dt, dt);
    EXPECT_EQ(motion.dt2, dt * dt);
  }
}

TEST(Motion, ofACameraOnABodyIsByVispsTwistMatrix) {
  Random random(7);
  for (int i = 0; i < 100; ++i) {
    vpColVector place(6), ofBody(6);
    for (unsigned j = 0; j < 6; ++j) {
      place[j] = random.uniform(-2, 2);
      ofBody[j] = random.uniform(-1, 1);
    }
    const vpHomogeneousMatrix bMc = vpExponentialMap::direct(place, 1);
    const vpColVector expected = vpVelocityTwistMatrix(bMc.inverse()) * ofBody;
    const Twist twist = twistOfCamera(
        pose(bMc), {{ofBody[0], ofBody[1], ofBody[2]}, {ofBody[3], ofBody[4], ofBody[5]}});
    for (unsigned j = 0; j < 6; ++j) EXPECT_NEAR(twist.vector()[j], expected[j], 1e-13);
  }
}

TEST(Motion, saysWhetherItIsFinite) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const Twist still;
  EXPECT_TRUE(Motion::fromTwist(still, 1).isFinite());
  for (double bad : {kNaN, kInf, -kInf}) {
    EXPECT_FALSE(Motion::fromTwist(still, bad).isFinite());
    EXPECT_FALSE(Motion::fromTwist({{bad, 0, 0}, {0, 0, 0}}, 1).isFinite());
    EXPECT_FALSE(Motion::fromTwist({{0, 0, 0}, {0, bad, 0}}, 1).isFinite());
  }
}

/// Property tests: whole numbers of millimetres and milliradians shrink to readable cases.
rc::Gen<double> thousandths(int limit) {
  return rc::gen::map(rc::gen::inRange(-limit, limit + 1), [](int n) { return n * 1e-3; });
}

Motion anyMotion() {
  const auto v = *rc::gen::container<std::vector<double>>(3, thousandths(2000));
  const auto w = *rc::gen::container<std::vector<double>>(3, thousandths(4000));
  const double dt = *rc::gen::map(rc::gen::inRange(1, 2000), [](int n) { return n * 1e-3; });
  return Motion::fromTwist({{v[0], v[1], v[2]}, {w[0], w[1], w[2]}}, dt);
}

RC_GTEST_PROP(MotionLaws, theInverseUndoes, ()) {
  const Motion a = anyMotion();
  const Motion none = a.then(a.inverse());
  RC_ASSERT((matrix(none) - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff() < 1e-12);
  RC_ASSERT(none.dt == 0.0);
}

RC_GTEST_PROP(MotionLaws, compositionIsAssociativeAndAddsDurations, ()) {
  const Motion a = anyMotion(), b = anyMotion(), c = anyMotion();
  const Motion left = a.then(b).then(c), right = a.then(b.then(c));
  RC_ASSERT((matrix(left) - matrix(right)).cwiseAbs().maxCoeff() < 1e-12);
  RC_ASSERT(std::abs(left.dt - (a.dt + b.dt + c.dt)) < 1e-12);
  RC_ASSERT(std::abs(left.dt2 - (a.dt2 + b.dt2 + c.dt2)) < 1e-12);
}

RC_GTEST_PROP(MotionLaws, compositionMovesAPointTwice, ()) {
  const Motion a = anyMotion(), b = anyMotion();
  const Eigen::Vector3d p(0.3, -0.2, 1.7);
  const Motion both = a.then(b);
  const Eigen::Vector3d once = both.R * p + both.t;
  const Eigen::Vector3d twice = b.R * (a.R * p + a.t) + b.t;
  RC_ASSERT((once - twice).norm() < 1e-12);
}

RC_GTEST_PROP(MotionLaws, theSameTwistForTwoTimesIsThatTwistForTheirSum, ()) {
  const Motion a = anyMotion();
  if (a.twist().angular.norm() * a.dt > 3) RC_DISCARD("the twist is unique below pi only");
  const Twist u = a.twist();
  const Motion halves = Motion::fromTwist(u, 0.3 * a.dt).then(Motion::fromTwist(u, 0.7 * a.dt));
  RC_ASSERT((matrix(halves) - matrix(a)).cwiseAbs().maxCoeff() < 1e-11);
}

TEST(UnknownMotion, growsByAccelerationThenAtFullSpeedAndPartsAddUp) {
  UnknownMotion bounds;
  bounds.speed_mps = 1;
  bounds.acceleration_mps2 = 2;
  const Twist last{{.6, 0, 0}, {0, 0, 0}};  // full speed after 0.2 s
  EXPECT_NEAR(bounds.over(last, 0, .2).distance_m, .16, 1e-12);
  EXPECT_NEAR(bounds.over(last, 0, 1).distance_m, .16 + .8, 1e-12);
  EXPECT_NEAR(bounds.over(last, .1, .7).distance_m + bounds.over(last, 0, .1).distance_m,
              bounds.over(last, 0, .7).distance_m, 1e-12);
  const Twist faster{{3, 0, 0}, {0, 0, 0}};
  EXPECT_NEAR(bounds.over(faster, 0, 2).distance_m, 6, 1e-12) << "it may go on as it was";
  bounds.acceleration_mps2 = 0;
  EXPECT_NEAR(bounds.over(last, 0, .5).distance_m, .5, 1e-12) << "any acceleration";
}

TEST(Motion, whatIsUnknownAddsUpAndMustBeFinite) {
  const Motion unknown = Motion::notKnown({.5, .2, .1});
  const Motion both = Motion::fromTwist({{.1, 0, 0}, {0, 0, .1}}, 1).then(unknown).then(unknown);
  EXPECT_NEAR(both.dt, 2, 1e-15);
  EXPECT_NEAR(both.unknown.duration_s, 1, 1e-15);
  EXPECT_NEAR(both.unknown.distance_m, .4, 1e-15);
  EXPECT_NEAR(both.unknown.angle_rad, .2, 1e-15);
  EXPECT_TRUE(both.isUsable());
  EXPECT_FALSE(Motion::notKnown({.5, std::nan(""), 0}).isUsable());
}

TEST(Motion, beyondAnyRobotIsOfNoUse) {
  constexpr double kMost = Twist::kLargestSpeed_mps;
  const Twist fastest{{0, 0, kMost}, {0, Twist::kLargestTurnRate_rps, 0}};
  EXPECT_TRUE(fastest.isUsable());
  for (const double dt : {1e-9, 1e-3, 1., 1e6}) {
    EXPECT_TRUE(Motion::fromTwist(fastest, dt).isUsable()) << dt;
    EXPECT_FALSE(Motion::fromTwist({{0, 0, 11 * kMost}, {0, 0, 0}}, dt).isUsable()) << dt;
  }
  Motion stretched = Motion::fromTwist(fastest, 1);
  stretched.R *= 2;
  EXPECT_FALSE(stretched.isUsable()) << "no rotation";
  UnknownMotion any;
  any.speed_mps = any.turnRate_rps = 1e300;
  any.acceleration_mps2 = any.turnAcceleration_rps2 = 0;
  EXPECT_LE(any.over({}, 0, 1).distance_m, kMost);
  EXPECT_TRUE(Motion::notKnown(any.over({}, 0, 1e6)).isUsable());
}

}  // namespace
}  // namespace depthservo
