// Robots whose camera goes wherever it is told.
#include <gtest/gtest.h>

#include "depthservo/robots/FreeCamera.h"
#include "depthservo/robots/OmniBase.h"
#include "depthservo/visp/using.h"
#include "support/CameraRobots.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::expectViSPsTwist;
using test::Random;
using test::StillPoint;

/// A still point, followed by integrating the camera twist that the robot says it has.
void expectStillPoint(SimulatedRobot& robot, const Velocities& command) {
  const Eigen::Vector3d wP(1, 2, 3);
  StillPoint point(robot.wMc().inverse() * wP);
  for (int i = 0; i < 10; ++i) {
    const Twist twist = robot.cameraTwist(robot.drive(command, 0.1));
    point.move(twist, 0.1);
  }
  EXPECT_MATRIX_NEAR(robot.wMc().inverse() * wP, point.cP(), 1e-9);
  EXPECT_MATRIX_NEAR((robot.wMc().linear().transpose() * robot.wMc().linear()).eval(),
                     Eigen::Matrix3d::Identity(), 1e-14);
}

TEST(FreeCamera, movesExactlyAsTold) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
    wMc.linear() = Eigen::AngleAxisd(1, random.direction()).matrix();
    wMc.translation() = random.vector(2);
    FreeCamera robot(wMc);
    Velocities command(6);
    command << random.vector(1), random.vector(1);
    expectStillPoint(robot, command);
    expectViSPsTwist(robot, command);
  }
}

TEST(FreeCamera, limitsScaleTheWholeTwist) {
  FreeCamera robot(Eigen::Isometry3d::Identity());
  robot.setLimits(0.1, 1);
  Velocities command(6);
  command << 0.2, 0, 0.1, 0, 0.5, 0;
  EXPECT_MATRIX_NEAR(robot.drive(command, 0.1), (command / 2).eval(), 1e-15);
  command[3] = std::nan("");
  EXPECT_EQ(robot.drive(command, 0.1).norm(), 0);
}

TEST(OmniBase, movesExactlyAsTold) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    OmniBase robot(random.vector(0.3));
    robot.setPose({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-3, 3)});
    const Velocities command = random.vector(1);
    expectStillPoint(robot, command);
    expectViSPsTwist(robot, command);
  }
}

TEST(OmniBase, limitsScaleAllThreeAndRubbishStopsIt) {
  OmniBase robot({0.1, 0, 0.3});
  robot.setLimits({0.1, 0.1, 1});
  EXPECT_EQ(robot.velocityLimits(), Eigen::Vector3d(0.1, 0.1, 1));
  const Eigen::Vector3d command(0.1, -0.4, 0.2);
  EXPECT_MATRIX_NEAR(robot.drive(command, 0.1), (command / 4).eval(), 1e-15);
  EXPECT_EQ(robot.drive(Eigen::Vector2d(1, 1), 0.1).norm(), 0);
}

}  // namespace
}  // namespace depthservo
