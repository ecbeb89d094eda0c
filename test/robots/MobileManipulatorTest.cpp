#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/robots/MobileManipulator.h"
#include "depthservo/visp/using.h"
#include "support/CameraRobots.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::errorAfterServoing;
using test::Random;
using State = MobileManipulator::State;
using Vector5d = MobileManipulator::Vector5d;

MobileManipulator::Geometry randomGeometry(Random& random) {
  return {random.vector(0.3), random.uniform(.1, .5), random.uniform(.1, .5),
          random.uniform(.1, .5)};
}
State randomState(Random& random) {
  return {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3), random.vector(3)};
}
Vector5d randomVelocity(Random& random) {
  Vector5d velocity;
  velocity << random.uniform(-1, 1), random.uniform(-1, 1), random.vector(1);
  return velocity;
}

TEST(MobileManipulator, tipIsWhereAChainOfFramesPutsIt) {
  using Eigen::AngleAxisd, Eigen::Vector3d, Eigen::Translation3d;
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const MobileManipulator::Geometry geometry = randomGeometry(random);
    const State state = randomState(random);
    // Joints 2 and 3 turn about -y, so that a positive angle raises.
    const Eigen::Isometry3d wMe =
        Translation3d(state.x, state.y, 0) * AngleAxisd(state.theta, Vector3d::UnitZ()) *
        Translation3d(geometry.mount) * AngleAxisd(state.joints[0], Vector3d::UnitZ()) *
        Translation3d(0, 0, geometry.column) * AngleAxisd(state.joints[1], -Vector3d::UnitY()) *
        Translation3d(geometry.upperArm, 0, 0) * AngleAxisd(state.joints[2], -Vector3d::UnitY()) *
        Translation3d(geometry.forearm, 0, 0);
    Eigen::Matrix3d eRc;
    eRc << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // camera x, y, z: right, down, forward
    const Eigen::Isometry3d wMc = MobileManipulator(geometry).wMcAt(state);
    EXPECT_MATRIX_NEAR(wMc.translation(), wMe.translation(), 1e-14);
    EXPECT_MATRIX_NEAR(wMc.linear(), (wMe.linear() * eRc).eval(), 1e-14);
  }
}

TEST(MobileManipulator, jacobianIsTheDerivativeOfThePose) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    MobileManipulator robot(randomGeometry(random));
    const State state = randomState(random);
    robot.setState(state);
    const auto moved = [&](const Vector5d& q, double h) {
      State s = state;
      s.x += h * q[0] * std::cos(state.theta);
      s.y += h * q[0] * std::sin(state.theta);
      s.theta += h * q[1];
      s.joints += h * q.tail<3>();
      return robot.wMcAt(s);
    };
    const Eigen::Matrix3d cRw = robot.wMc().linear().transpose();
    for (int column = 0; column < 5; ++column) {
      const Vector5d q = Vector5d::Unit(column);
      const double h = 1e-5;
      const Eigen::Isometry3d before = moved(q, -h), after = moved(q, h);
      const Eigen::Matrix3d W = cRw * (after.linear() - before.linear()) / (2 * h);
      Eigen::Matrix<double, 6, 1> twist;
      twist << cRw * (after.translation() - before.translation()) / (2 * h), W(2, 1), W(0, 2),
          W(1, 0);
      EXPECT_MATRIX_NEAR(robot.cameraJacobian().col(column), twist, 1e-9);
    }
    const Vector5d q = randomVelocity(random);
    const Twist twist = robot.cameraTwist(q);
    EXPECT_MATRIX_NEAR(twist.linear, (robot.cameraJacobian() * q).head<3>(), 1e-15);
    EXPECT_MATRIX_NEAR(twist.angular, (robot.cameraJacobian() * q).tail<3>(), 1e-15);
  }
}

TEST(MobileManipulator, stepsAddUpExactly) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const MobileManipulator::Geometry geometry = randomGeometry(random);
    const State start = randomState(random);
    const Vector5d q = randomVelocity(random);
    MobileManipulator once(geometry), often(geometry);
    once.setState(start);
    often.setState(start);
    once.drive(q, 1);
    for (int k = 0; k < 100; ++k) often.drive(q, 0.01);
    EXPECT_MATRIX_NEAR(once.wMc().matrix(), often.wMc().matrix(), 1e-12);
    EXPECT_EQ(once.velocity(), Eigen::VectorXd(q));
  }
}

TEST(MobileManipulator, viSPsMatricesGiveTheSameTwist) {
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    MobileManipulator robot(randomGeometry(random));
    robot.setState(randomState(random));
    const vpMatrix J = robot.cVe() * robot.eJe();
    ASSERT_EQ(J.getRows(), 6u);
    ASSERT_EQ(J.getCols(), 5u);
    Eigen::Matrix<double, 6, 5> eigen;
    for (unsigned row = 0; row < 6; ++row) {
      for (unsigned column = 0; column < 5; ++column) eigen(row, column) = J[row][column];
    }
    EXPECT_MATRIX_NEAR(eigen, robot.cameraJacobian(), 1e-15);
  }
}

TEST(MobileManipulator, vpServoDrivesItsFiveInputsToTheGoalImage) {
  MobileManipulator robot({{0.3, 0, 0.2}});  // w and q1' together move the camera sideways
  robot.setState({0.6, 0.05, 0, {0, 0.9, -0.9}});
  const Eigen::Isometry3d goal = robot.wMc();
  robot.setState({0, 0, 0.1, {0.1, 0.7, -0.8}});
  const double error = errorAfterServoing(
      robot, {{{2, .1, .7}, {2, -.1, .7}, {2, -.1, .5}, {2, .1, .5}}}, goal, 400, 0.05);
  EXPECT_EQ(robot.velocity().size(), 5);
  EXPECT_LT(error, 1e-4);
}

TEST(MobileManipulator, limitsScaleAllFiveAndRubbishStopsIt) {
  MobileManipulator robot({});
  robot.setLimits((Vector5d() << 0.5, 1, 1, 1, 0.2).finished());
  Vector5d command;
  command << 0.5, 0.2, -0.4, 0.1, -0.4;
  EXPECT_MATRIX_NEAR(robot.drive(command, 0.1), (command / 2).eval(), 1e-15);
  EXPECT_EQ(robot.drive(command, std::nan("")), robot.velocity()) << "no time passed";
  command[2] = INFINITY;
  EXPECT_EQ(robot.drive(command, 0.1).norm(), 0);
  EXPECT_EQ(robot.drive(Eigen::Vector3d(1, 1, 1), 0.1).norm(), 0);
  EXPECT_TRUE(robot.wMc().matrix().allFinite());
}

}  // namespace
}  // namespace depthservo
