#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "depthservo/features/TaskFunction.h"
#include "depthservo/robots/FreeCamera.h"
#include "depthservo/robots/PanUnicycle.h"
#include "depthservo/visp/using.h"
#include "support/MatrixMatchers.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

const std::vector<Eigen::Vector3d> kLandmark{
    {0, -.3, -.3}, {0, .3, -.3}, {0, .3, .3}, {0, -.3, .3}};
constexpr double kPi = 3.14159265358979323846;

std::vector<PointState> seen(const Eigen::Isometry3d& wMc) {
  std::vector<PointState> points;
  for (const Eigen::Vector3d& wP : kLandmark) {
    const Eigen::Vector3d p = wMc.inverse() * wP;
    points.push_back({p.x() / p.z(), p.y() / p.z(), 1 / p.z()});
  }
  return points;
}

Eigen::VectorXd features(const std::vector<PointState>& points) {
  Eigen::VectorXd s(2 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    s.segment<2>(static_cast<Eigen::Index>(2 * i)) << points[i].x, points[i].y;
  }
  return s;
}

/// cVe eJe.
Eigen::MatrixXd cameraJacobian(const SimulatedRobot& robot) {
  const vpMatrix J = robot.cVe() * robot.eJe();
  Eigen::MatrixXd result(J.getRows(), J.getCols());
  for (unsigned i = 0; i < J.getRows(); ++i) {
    for (unsigned j = 0; j < J.getCols(); ++j) result(i, j) = J[i][j];
  }
  return result;
}

PanUnicycle atGoal() {
  PanUnicycle robot({});
  robot.setState({1.2, 0, -kPi, 0});
  return robot;
}

TEST(TaskFunction, errorIsTheCamerasWayFromTheGoal) {
  const TaskFunction task(seen(atGoal().wMc()), TaskFunction::planar());
  EXPECT_MATRIX_NEAR((task.C() * task.L()).eval(), Eigen::Matrix3d::Identity(), 1e-13);
  // L against points that move as seen from a camera with these twists, by integration.
  const Twist twists[] = {{{1, 0, 0}, {0, 0, 0}}, {{0, 0, 1}, {0, 0, 0}}, {{0, 0, 0}, {0, 1, 0}}};
  const std::vector<PointState> goal = seen(atGoal().wMc());
  for (int dof = 0; dof < 3; ++dof) {
    for (int i = 0; i < 4; ++i) {
      const double h = 1e-5;
      test::StillPoint before = test::StillPoint::at(goal[i].x, goal[i].y, 1 / goal[i].chi);
      test::StillPoint after = before;
      after.move(twists[dof], h);
      before.move({-twists[dof].linear, -twists[dof].angular}, h);
      EXPECT_NEAR(task.L()(2 * i, dof), (after.x() - before.x()) / (2 * h), 1e-8);
      EXPECT_NEAR(task.L()(2 * i + 1, dof), (after.y() - before.y()) / (2 * h), 1e-8);
    }
  }
}

TEST(TaskFunction, drivesThePanUnicycleAlongThePapersPath) {
  const TaskFunction task(seen(atGoal().wMc()), TaskFunction::planar());
  PanUnicycle robot({});
  robot.setState({5, 5, -2.35, 0});
  for (int k = 0; k < 300; ++k) {
    const Eigen::VectorXd q = task.command(features(seen(robot.wMc())), cameraJacobian(robot), 0.7);
    if (k == 0) {
      EXPECT_MATRIX_NEAR(q, Eigen::Vector3d(0.6130, 0.0743, -0.0849), 1e-4);
    }
    if (k == 50) {
      EXPECT_NEAR(robot.state().x, 2.9868, 1e-4);
      EXPECT_NEAR(robot.state().y, 2.8615, 1e-4);
      EXPECT_NEAR(robot.state().theta, -2.3038, 1e-4);
      EXPECT_NEAR(robot.state().pan, -0.1342, 1e-4);
    }
    robot.drive(q, 0.1);
  }
  EXPECT_LT((features(seen(robot.wMc())) - task.desired()).norm(), 1e-5);
}

TEST(TaskFunction, drivesAFreeCamera) {
  Eigen::Isometry3d goal = atGoal().wMc();
  const TaskFunction task(seen(goal), TaskFunction::all());
  FreeCamera robot(goal * Eigen::Translation3d(.1, -.05, -.2) *
                   Eigen::AngleAxisd(.2, Eigen::Vector3d(1, 1, 1).normalized()));
  for (int k = 0; k < 300; ++k) {
    robot.drive(task.command(features(seen(robot.wMc())), cameraJacobian(robot), 1), 0.05);
  }
  EXPECT_MATRIX_NEAR(robot.wMc().matrix(), goal.matrix(), 1e-5);
}

TEST(TaskFunction, pointsThatDoNotDetermineTheTaskAreRefused) {
  EXPECT_THROW(TaskFunction({{.1, .1, 1}}, TaskFunction::planar()), std::invalid_argument);
  EXPECT_THROW(TaskFunction({}, TaskFunction::planar()), std::invalid_argument);
  EXPECT_THROW(TaskFunction({{NAN, .1, 1}, {.1, .2, 1}}, TaskFunction::planar()),
               std::invalid_argument);
}

TEST(TaskFunction, rubbishGivesTheZeroCommand) {
  const TaskFunction task(seen(atGoal().wMc()), TaskFunction::planar());
  const PanUnicycle robot = atGoal();
  Eigen::VectorXd s = features(seen(robot.wMc()));
  EXPECT_EQ(task.command(s, Eigen::MatrixXd::Zero(6, 3), 1).norm(), 0) << "singular";
  s[0] = std::nan("");
  EXPECT_EQ(task.command(s, cameraJacobian(robot), 1).norm(), 0);
}

}  // namespace
}  // namespace depthservo
