#pragma once

#include "depthservo/robots/RobotModel.h"

namespace depthservo {

/// Twist of the camera by unit velocities of the robot (6xn): cVe eJe.
inline Eigen::MatrixXd cameraJacobian(const RobotModel& robot) {
  const DEPTHSERVO_VISP vpMatrix J = DEPTHSERVO_VISP vpMatrix(robot.cVe()) * robot.eJe();
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(J.data, J.getRows(), J.getCols());
}

}  // namespace depthservo
