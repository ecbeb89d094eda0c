#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "depthservo/motion/Motion.h"
#include "depthservo/pose/PoseRegulation.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

Eigen::Isometry3d randomPose(Random& random, double position, double angle) {
  Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
  g.translation() = random.vector(position);
  g.linear() = Eigen::AngleAxisd(random.uniform(0, angle), random.direction()).matrix();
  return g;
}

/// The pose of a still target after the camera has moved with the twist, from rigid-body kinematics
/// in the camera's own frame.
Eigen::Isometry3d afterMove(const Eigen::Isometry3d& cMo, const Twist& twist, double dt) {
  const double angle = twist.angular.norm() * dt;
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();  // the later camera in the earlier one
  if (angle > 0) {
    moved.linear() = Eigen::AngleAxisd(angle, twist.angular.normalized()).matrix();
  }
  moved.translation() = twist.linear * dt;
  return moved.inverse() * cMo;
}

TEST(PoseRegulation, errorDecaysAtTheGainFromAnyPose) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d cdMo = randomPose(random, 1, 3), cMo = cdMo * randomPose(random, 1, .5);
    PoseRegulationOptions options;
    options.kc = random.uniform(.5, 5);
    const PoseRegulation regulation(cdMo, options);
    const double dt = 1e-6;
    const Vector6d before = regulation.error(cMo);
    const Vector6d after = regulation.error(afterMove(cMo, regulation.command(cMo), dt));
    const Eigen::Vector3d position = (after - before).head<3>() / dt;
    // The position in the axes of the desired target also turns with the camera's rotation.
    const Eigen::Vector3d w = cdMo.linear().transpose() * regulation.command(cMo).angular;
    const Eigen::Vector3d expected = -options.kc * before.head<3>() - w.cross(before.head<3>());
    EXPECT_MATRIX_NEAR(position, expected, 1e-4);
    EXPECT_LT(after.tail<3>().norm(), before.tail<3>().norm() + 1e-15);
  }
}

TEST(PoseRegulation, reachesTheDesiredPose) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Isometry3d cdMo = randomPose(random, 1, 3);
    Eigen::Isometry3d cMo = cdMo * randomPose(random, 2, 2.5);
    const PoseRegulation regulation(cdMo, {});
    for (int k = 0; k < 3000; ++k) cMo = afterMove(cMo, regulation.command(cMo), .01);
    EXPECT_LT(regulation.error(cMo).norm(), 1e-9);
    EXPECT_LT(poseEnergy(cdMo.inverse() * cMo), 1e-9) << "not the far side of the turn";
  }
}

TEST(PoseRegulation, stopsAtTheDesiredPose) {
  Random random(3);
  const Eigen::Isometry3d cdMo = randomPose(random, 1, 3);
  const Twist twist = PoseRegulation(cdMo).command(cdMo);
  EXPECT_LT(twist.linear.norm() + twist.angular.norm(), 1e-14);
}

TEST(PoseRegulation, planarRobotIsAskedOnlyForWhatItCanDo) {
  Random random(4);
  PoseRegulationOptions options;
  const Eigen::Isometry3d cdMo = randomPose(random, 1, 3), cMo = randomPose(random, 1, 3);
  const Twist full = PoseRegulation(cdMo, options).command(cMo);
  options.mobility = Mobility::planar;
  const Twist planar = PoseRegulation(cdMo, options).command(cMo);
  EXPECT_MATRIX_NEAR(planar.linear, Eigen::Vector3d(full.linear.x(), 0, full.linear.z()), 0);
  EXPECT_MATRIX_NEAR(planar.angular, Eigen::Vector3d(0, full.angular.y(), 0), 0);
}

TEST(PoseRegulation, limitsKeepTheDirection) {
  Random random(5);
  const Eigen::Isometry3d cdMo = randomPose(random, 1, 3);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d cMo = randomPose(random, 5, 3);
    PoseRegulationOptions options;
    const Twist free = PoseRegulation(cdMo, options).command(cMo);
    options.maxLinear = .3;
    options.maxAngular = .2;
    const Twist limited = PoseRegulation(cdMo, options).command(cMo);
    EXPECT_LE(limited.linear.norm(), .3 + 1e-12);
    EXPECT_LE(limited.angular.norm(), .2 + 1e-12);
    const double factor = limited.linear.norm() / free.linear.norm();
    EXPECT_MATRIX_NEAR(limited.linear, (factor * free.linear).eval(), 1e-12);
    EXPECT_MATRIX_NEAR(limited.angular, (factor * free.angular).eval(), 1e-12);
  }
}

TEST(PoseRegulation, poseThatIsNoNumberStopsTheRobot) {
  const PoseRegulation regulation(Eigen::Isometry3d::Identity());
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
    cMo.translation().y() = bad;
    const Twist twist = regulation.command(cMo);
    EXPECT_EQ(twist.linear.norm() + twist.angular.norm(), 0) << bad;
  }
}

TEST(PoseError, energyBoundsTheError) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Isometry3d g = randomPose(random, 2, 3.14159);
    const double e2 = poseError(g).squaredNorm(), U = poseEnergy(g);
    EXPECT_LE(0.5 * e2, U + 1e-12);
    const bool isWithinQuarterTurn = g.linear().trace() >= 1;
    if (isWithinQuarterTurn) {
      EXPECT_LE(U, e2 + 1e-12);
    }
  }
}

TEST(PoseError, isPositionAndSineOfTheAngle) {
  Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
  g.translation() << 1, -2, 3;
  g.linear() = Eigen::AngleAxisd(.7, Eigen::Vector3d(2, -1, 2) / 3).matrix();
  Vector6d expected;
  expected << 1, -2, 3, std::sin(.7) * Eigen::Vector3d(2, -1, 2) / 3;
  EXPECT_MATRIX_NEAR(poseError(g), expected, 1e-15);
  EXPECT_NEAR(poseEnergy(g), 7 + 1 - std::cos(.7), 1e-14);
}

}  // namespace
}  // namespace depthservo
