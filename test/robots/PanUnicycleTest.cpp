#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "depthservo/robots/PanUnicycle.h"
#include "depthservo/visp/using.h"
#include "support/CameraRobots.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::errorAfterServoing;
using test::expectViSPsTwist;
using test::Random;
using State = PanUnicycle::State;

PanUnicycle::Geometry randomGeometry(Random& random) {
  return {random.uniform(.05, .4), random.uniform(-.2, .2), random.uniform(-.2, .2), 0.5};
}
State randomState(Random& random) {
  return {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3),
          random.uniform(-2, 2)};
}

/// The kinematics integrated by Runge-Kutta 4.
State integrated(State s, const Eigen::Vector3d& q, double dt) {
  const int steps = 400;
  const double h = dt / steps;
  for (int i = 0; i < steps; ++i) {
    const auto slope = [&](double theta) {
      return Eigen::Vector2d(q[0] * std::cos(theta), q[0] * std::sin(theta));
    };
    const Eigen::Vector2d way =
        h / 6 * (slope(s.theta) + 4 * slope(s.theta + h / 2 * q[1]) + slope(s.theta + h * q[1]));
    s.x += way.x();
    s.y += way.y();
    s.theta += h * q[1];
    s.pan += h * q[2];
  }
  return s;
}

TEST(PanUnicycle, stepIsExact) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    PanUnicycle robot(randomGeometry(random));
    const State start = randomState(random);
    robot.setState(start);
    const Eigen::Vector3d q = random.vector(2);
    robot.drive(q, 0.7);
    const State expected = integrated(start, q, 0.7);
    EXPECT_NEAR(robot.state().x, expected.x, 1e-11);
    EXPECT_NEAR(robot.state().y, expected.y, 1e-11);
    EXPECT_NEAR(robot.state().theta, expected.theta, 1e-12);
    EXPECT_NEAR(robot.state().pan, expected.pan, 1e-12);
  }
}

TEST(PanUnicycle, stepIsContinuousDownToNoTurnAtAll) {
  for (double v : {0.6, -0.6, 0.0}) {
    PanUnicycle straight({});
    straight.setState({1, 2, 0.3, 0});
    straight.drive(Eigen::Vector3d(v, 0, 0), 0.1);
    for (double w = 1; w > 1e-301; w /= 10) {
      PanUnicycle robot({});
      robot.setState({1, 2, 0.3, 0});
      robot.drive(Eigen::Vector3d(v, w, 0), 0.1);
      EXPECT_NEAR(robot.state().x, straight.state().x, 0.01 * w + 1e-15) << w;
      EXPECT_NEAR(robot.state().y, straight.state().y, 0.01 * w + 1e-15) << w;
    }
  }
}

TEST(PanUnicycle, cameraTwistIsTheDerivativeOfItsPose) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    PanUnicycle robot(randomGeometry(random));
    const State state = randomState(random);
    robot.setState(state);
    const Eigen::Vector3d q = random.vector(1);
    const Twist twist = robot.cameraTwist(q);
    const double h = 1e-4;
    const Eigen::Isometry3d before = robot.wMcAt(integrated(state, q, -h));
    const Eigen::Isometry3d after = robot.wMcAt(integrated(state, q, h));
    const Eigen::Isometry3d wMc = robot.wMc();
    const Eigen::Vector3d v =
        wMc.linear().transpose() * (after.translation() - before.translation()) / (2 * h);
    const Eigen::Matrix3d W =
        wMc.linear().transpose() * (after.linear() - before.linear()) / (2 * h);
    EXPECT_MATRIX_NEAR(twist.linear, v, 1e-8);
    EXPECT_MATRIX_NEAR(twist.angular, Eigen::Vector3d(W(2, 1), W(0, 2), W(1, 0)), 1e-7);
  }
}

TEST(PanUnicycle, jacobianHasDeterminantDxAndTheClosedInverse) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const PanUnicycle::Geometry geometry = randomGeometry(random);
    PanUnicycle robot(geometry);
    robot.setState(randomState(random));
    const Eigen::Matrix3d J = robot.cameraJacobian();
    EXPECT_NEAR(J.determinant(), geometry.Dx, 1e-14);
    const Eigen::Vector3d wanted = random.vector(1);
    EXPECT_MATRIX_NEAR(J * robot.velocityFor(wanted), wanted, 1e-13);
    const Twist twist = robot.cameraTwist(robot.velocityFor(wanted));
    EXPECT_NEAR(-twist.linear.x(), wanted[0], 1e-13);
    EXPECT_NEAR(twist.linear.z(), wanted[1], 1e-13);
    EXPECT_NEAR(twist.angular.y(), wanted[2], 1e-13);
  }
}

TEST(PanUnicycle, viSPsMatricesGiveTheSameTwist) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    PanUnicycle robot(randomGeometry(random));
    robot.setState(randomState(random));
    expectViSPsTwist(robot, random.vector(1));
  }
}

TEST(PanUnicycle, vpServoDrivesItsThreeInputsToTheGoalImage) {
  PanUnicycle robot({});
  robot.setState({1.2, 0, -3.14159265358979, 0});
  const Eigen::Isometry3d goal = robot.wMc();
  robot.setState({2.2, 0.3, -3.0, 0.1});
  const double error = errorAfterServoing(
      robot, {{{0, -.3, -.3}, {0, .3, -.3}, {0, .3, .3}, {0, -.3, .3}}}, goal, 300, 0.1);
  EXPECT_EQ(robot.velocity().size(), 3);
  EXPECT_LT(error, 1e-4);
}

TEST(PanUnicycle, limitsKeepTheDirectionOfTheCamera) {
  PanUnicycle robot({});
  robot.setLimits({{0.2, 1, 0.5}, Eigen::Vector3d::Constant(INFINITY), -9, 9});
  const Eigen::Vector3d command(0.4, 0.1, -2);
  const Eigen::Vector3d applied = robot.drive(command, 0.1);
  EXPECT_MATRIX_NEAR(applied, (command * 0.25).eval(), 1e-15);
  EXPECT_EQ(robot.velocity(), applied);
}

TEST(PanUnicycle, accelerationIsLimited) {
  PanUnicycle robot({});
  PanUnicycleLimits limits;
  limits.acceleration << 1, 2, 4;
  robot.setLimits(limits);
  EXPECT_MATRIX_NEAR(robot.drive(Eigen::Vector3d(1, 0, 0), 0.1), Eigen::Vector3d(.1, 0, 0), 1e-15);
  EXPECT_MATRIX_NEAR(robot.drive(Eigen::Vector3d(1, 0, 0), 0.1), Eigen::Vector3d(.2, 0, 0), 1e-15);
}

TEST(PanUnicycle, jointStopsAtItsEndAndTellsSo) {
  PanUnicycle robot({});
  PanUnicycleLimits limits;
  limits.pan_min = -0.1;
  limits.pan_max = 0.25;
  robot.setLimits(limits);
  for (int i = 0; i < 2; ++i) robot.drive(Eigen::Vector3d(0.1, 0, 1), 0.1);
  EXPECT_NEAR(robot.drive(Eigen::Vector3d(0.1, 0, 1), 0.1)[2], 0.5, 1e-12);
  EXPECT_EQ(robot.state().pan, 0.25);
  EXPECT_EQ(robot.drive(Eigen::Vector3d(0.1, 0, 1), 0.1)[2], 0);
  EXPECT_NEAR(robot.velocity()[0], 0.1, 1e-15) << "the base drives on";
  EXPECT_EQ(robot.drive(Eigen::Vector3d(0, 0, -1), 0.1)[2], -1);
}

TEST(PanUnicycle, commandThatIsNotFiniteOrOfAnotherSizeStopsIt) {
  PanUnicycle robot({});
  robot.drive(Eigen::Vector3d(1, 1, 1), 0.1);
  for (double bad : {std::nan(""), double(INFINITY)}) {
    EXPECT_EQ(robot.drive(Eigen::Vector3d(bad, 0, 0), 0.1).norm(), 0);
  }
  EXPECT_EQ(robot.drive(Eigen::Vector2d(1, 1), 0.1).norm(), 0);
  EXPECT_TRUE(std::isfinite(robot.state().x));
}

}  // namespace
}  // namespace depthservo
