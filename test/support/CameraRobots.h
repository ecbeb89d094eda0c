#pragma once

#include <gtest/gtest.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

#include <array>

#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo::test {

/// cVe eJe q against cameraTwist(q).
inline void expectViSPsTwist(const SimulatedRobot& robot, const Velocities& q) {
  const DEPTHSERVO_VISP vpMatrix J = DEPTHSERVO_VISP vpMatrix(robot.cVe()) * robot.eJe();
  ASSERT_EQ(J.getRows(), 6u);
  ASSERT_EQ(J.getCols(), q.size());
  const Twist twist = robot.cameraTwist(q);
  for (unsigned row = 0; row < 6; ++row) {
    double value = 0;
    for (unsigned i = 0; i < q.size(); ++i) value += J[row][i] * q[i];
    EXPECT_NEAR(value, row < 3 ? twist.linear[row] : twist.angular[row - 3], 1e-13) << row;
  }
}

/// ViSP's own visual servoing drives the robot to where its camera sees four points of the world as
/// from `goal`. \return what is left of the error in the image [-]
inline double errorAfterServoing(SimulatedRobot& robot, const std::array<Eigen::Vector3d, 4>& wPs,
                                 const Eigen::Isometry3d& goal, int steps, double period_s) {
  using vpFeaturePoint = DEPTHSERVO_VISP vpFeaturePoint;
  using vpServo = DEPTHSERVO_VISP vpServo;
  const auto look = [&](const Eigen::Isometry3d& wMc, vpFeaturePoint* s) {
    for (std::size_t i = 0; i < wPs.size(); ++i) {
      const Eigen::Vector3d p = wMc.inverse() * wPs[i];
      s[i].buildFrom(p.x() / p.z(), p.y() / p.z(), p.z());
    }
  };
  vpFeaturePoint s[4], desired[4];
  look(goal, desired);
  vpServo task;
  task.setServo(vpServo::EYEINHAND_L_cVe_eJe);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.7);
  task.set_cVe(robot.cVe());
  for (int i = 0; i < 4; ++i) task.addFeature(s[i], desired[i]);
  for (int k = 0; k < steps; ++k) {
    look(robot.wMc(), s);
    task.set_eJe(robot.eJe());
    const DEPTHSERVO_VISP vpColVector q = task.computeControlLaw();
    robot.drive(Eigen::Map<const Velocities>(q.data, q.size()), period_s);
  }
  return task.getError().frobeniusNorm();
}

}  // namespace depthservo::test
