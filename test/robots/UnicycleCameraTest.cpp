#include <gtest/gtest.h>
#include <visp3/robot/vpPioneer.h>

#include <cmath>
#include <limits>
#include <vector>

#include "depthservo/features/cameraTwist.h"
#include "depthservo/robots/UnicycleCamera.h"
#include "depthservo/visp/using.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;
using Command = Eigen::Vector2d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

struct Mounting {
  Eigen::Vector3d offset;
  double yaw;
};
const std::vector<Mounting> kMountings{{{0, 0, 0}, 0},
                                       {{.13, 0, 0}, 0},
                                       {{.07, .02, .13}, 0},
                                       {{.07, .02, .13}, .4},
                                       {{-.2, .3, .5}, -2.5}};

Eigen::Matrix<double, 6, 1> vector(const Twist& u) {
  Eigen::Matrix<double, 6, 1> v;
  v << u.linear, u.angular;
  return v;
}

/// Twist of the camera in its own frame at a pose between two others, h apart.
Eigen::Matrix<double, 6, 1> differenced(const Eigen::Isometry3d& before,
                                        const Eigen::Isometry3d& between,
                                        const Eigen::Isometry3d& after, double h) {
  const Eigen::Matrix3d R = before.linear().transpose() * after.linear();
  const Eigen::Matrix3d W = (R - R.transpose()) / (2 * h);
  Eigen::Matrix<double, 6, 1> v;
  v << between.linear().transpose() * (after.translation() - before.translation()) / h, W(2, 1),
      W(0, 2), W(1, 0);
  return v;
}

TEST(UnicycleCamera, twistIsTheSameThreeWays) {
  Random random(1);
  for (const Mounting& mounting : kMountings) {
    UnicycleCamera robot(mounting.offset, mounting.yaw);
    robot.setPose({.5, -.3, .8});
    for (int i = 0; i < 20; ++i) {
      const Command q(random.uniform(-1, 1), random.uniform(-1, 1));
      const auto twist = vector(robot.cameraTwist(q));

      vpColVector q_visp(2);
      q_visp[0] = q[0];
      q_visp[1] = q[1];
      const vpColVector v = cameraTwist(robot.cVe(), robot.eJe(), q_visp);
      Eigen::Matrix<double, 6, 1> throughMatrices;
      for (unsigned j = 0; j < 6; ++j) throughMatrices[j] = v[j];
      EXPECT_MATRIX_NEAR(twist, throughMatrices, 1e-12);

      const double h = 1e-5;  // central: half a step back, half a step forward
      UnicycleCamera back = robot, forward = robot;
      back.drive(-q, h / 2);
      forward.drive(q, h / 2);
      EXPECT_MATRIX_NEAR(twist, differenced(back.wMc(), robot.wMc(), forward.wMc(), h), 1e-9);
    }
  }
}

TEST(UnicycleCamera, ofAPioneerIsViSPsPioneer) {
  const UnicycleCamera robot({.13, 0, 0});
  const vpPioneer pioneer;
  const vpMatrix difference =
      vpMatrix(robot.cVe()) * robot.eJe() - vpMatrix(pioneer.get_cVe()) * pioneer.get_eJe();
  EXPECT_NEAR(difference.frobeniusNorm(), 0, 1e-12);
}

TEST(UnicycleCamera, looksAheadWithImageRightAtTheRobotsRight) {
  const UnicycleCamera robot({.1, .2, .3});
  const Eigen::Isometry3d wMc = robot.wMc();
  EXPECT_MATRIX_NEAR(wMc.linear().col(2), Eigen::Vector3d::UnitX(), 1e-15);   // z: forward
  EXPECT_MATRIX_NEAR(wMc.linear().col(0), -Eigen::Vector3d::UnitY(), 1e-15);  // x: right
  EXPECT_MATRIX_NEAR(wMc.linear().col(1), -Eigen::Vector3d::UnitZ(), 1e-15);  // y: down
  EXPECT_MATRIX_NEAR(wMc.translation(), Eigen::Vector3d(.1, .2, .3), 1e-15);
}

TEST(UnicycleCamera, yawTurnsTheCameraCounterClockwise) {
  const UnicycleCamera robot({0, 0, 0}, std::acos(-1.) / 2);
  EXPECT_MATRIX_NEAR(robot.wMc().linear().col(2), Eigen::Vector3d::UnitY(), 1e-15);
}

TEST(UnicycleCamera, drivesTheExactArcAtAnyTurnRate) {
  for (double w : {1.5, .3, -.7, 1e-3, 1e-5, 1e-9, 0.}) {
    const double v = .4, T = 2;
    UnicycleCamera once({0, 0, 0}), often({0, 0, 0});
    once.setPose({1, 2, .3});
    often.setPose({1, 2, .3});
    once.drive(Command(v, w), T);
    for (int i = 0; i < 1000; ++i) often.drive(Command(v, w), T / 1000);
    // Circle of radius v/w; its limit is the straight line (series to third order).
    const double a = w * T;
    const double along = std::abs(a) > 1e-2 ? v / w * std::sin(a) : v * T * (1 - a * a / 6);
    const double across =
        std::abs(a) > 1e-2 ? v / w * (1 - std::cos(a)) : v * T * (a / 2 - a * a * a / 24);
    const double c = std::cos(.3), s = std::sin(.3);
    for (const UnicycleCamera* robot : {&once, &often}) {
      EXPECT_NEAR(robot->pose().x, 1 + c * along - s * across, 1e-10) << "w " << w;
      EXPECT_NEAR(robot->pose().y, 2 + s * along + c * across, 1e-10) << "w " << w;
      EXPECT_NEAR(robot->pose().theta, .3 + a, 1e-12) << "w " << w;
    }
  }
}

TEST(UnicycleCamera, limitsScaleBothVelocitiesByOneFactor) {
  UnicycleCamera robot({.1, 0, 0});
  robot.setLimits({.5, 1});
  EXPECT_MATRIX_NEAR(robot.drive(Command(.4, -.9), .1), Command(.4, -.9), 1e-15);
  EXPECT_MATRIX_NEAR(robot.drive(Command(2, .4), .1), Command(.5, .1), 1e-15);
  EXPECT_MATRIX_NEAR(robot.drive(Command(.4, -4), .1), Command(.1, -1), 1e-15);
  EXPECT_MATRIX_NEAR(robot.drive(Command(5, 20), .1), Command(.25, 1), 1e-15);
  EXPECT_MATRIX_NEAR(robot.drive(Command(-20, 20), .1), Command(-.5, .5), 1e-15);
}

TEST(UnicycleCamera, accelerationLimitsBoundEveryChange) {
  Random random(2);
  UnicycleCamera robot({.1, 0, 0});
  robot.setLimits({.5, 1, 1, 2});
  const double dt = 1. / 30;
  Eigen::Vector2d before = robot.velocity();
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d now =
        robot.drive(Command(random.uniform(-3, 3), random.uniform(-3, 3)), dt);
    EXPECT_LE(std::abs(now[0] - before[0]), 1 * dt + 1e-12);
    EXPECT_LE(std::abs(now[1] - before[1]), 2 * dt + 1e-12);
    EXPECT_LE(std::abs(now[0]), .5 + 1e-12);
    EXPECT_LE(std::abs(now[1]), 1 + 1e-12);
    before = now;
  }
  for (int i = 0; i < 60; ++i) robot.drive(Command(.3, .2), dt);
  EXPECT_MATRIX_NEAR(robot.velocity(), Command(.3, .2), 1e-12);
}

TEST(UnicycleCamera, lagIsOfFirstOrder) {
  UnicycleCamera robot({.1, 0, 0});
  robot.setLag(.08);
  const double dt = .02;
  for (int i = 1; i <= 20; ++i) {
    const Eigen::Vector2d v = robot.drive(Command(.4, -.2), dt);
    EXPECT_MATRIX_NEAR(v, Command(.4, -.2) * (1 - std::exp(-i * dt / .08)), 1e-12);
  }
}

TEST(UnicycleCamera, unusableCommandStopsIt) {
  for (const Velocities& bad : {Velocities(Command(kNaN, .1)), Velocities(Command(.1, kInf)),
                                Velocities(Eigen::Vector3d(.1, .1, .1)), Velocities()}) {
    UnicycleCamera robot({.1, 0, 0});
    robot.drive(Command(.4, .2), .1);
    const UnicycleCamera::Pose pose = robot.pose();
    EXPECT_MATRIX_NEAR(robot.drive(bad, .1), Command(0, 0), 0);
    EXPECT_EQ(robot.pose().x, pose.x);
    EXPECT_EQ(robot.pose().theta, pose.theta);
    EXPECT_MATRIX_NEAR(robot.drive(Command(.4, .2), .1), Command(.4, .2), 1e-15);
  }
}

TEST(UnicycleCamera, unusableCommandBrakesWithinTheAccelerationLimit) {
  UnicycleCamera robot({.1, 0, 0});
  robot.setLimits({.5, 1, 1, 2});
  for (int i = 0; i < 100; ++i) robot.drive(Command(.5, 0), .01);
  EXPECT_NEAR(robot.drive(Command(kNaN, 0), .1)[0], .4, 1e-12);
  for (int i = 0; i < 5; ++i) robot.drive(Command(kNaN, 0), .1);
  EXPECT_MATRIX_NEAR(robot.velocity(), Command(0, 0), 1e-12);
}

TEST(UnicycleCamera, velocityIsWhatWasReallyApplied) {
  Random random(3);
  UnicycleCamera robot({.1, .05, 0}, .3);
  robot.setLimits({.5, 1, 1, 2});
  robot.setLag(.08);
  EXPECT_MATRIX_NEAR(robot.velocity(), Command(0, 0), 0);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Isometry3d before = robot.wMc();
    const double dt = 1e-4;
    const Velocities returned =
        robot.drive(Command(random.uniform(-3, 3), random.uniform(-3, 3)), dt);
    EXPECT_MATRIX_NEAR(robot.velocity(), returned, 0);
    EXPECT_MATRIX_NEAR(vector(robot.cameraTwist(robot.velocity())),
                       differenced(before, before, robot.wMc(), dt), 1e-4);
  }
}

TEST(UnicycleCamera, noTimeNoMotion) {
  UnicycleCamera robot({.1, 0, 0});
  robot.setPose({1, 2, 3});
  robot.drive(Command(.4, .2), 0);
  EXPECT_EQ(robot.pose().x, 1);
  EXPECT_EQ(robot.pose().theta, 3);
  EXPECT_TRUE(robot.velocity().allFinite());
}

}  // namespace
}  // namespace depthservo
