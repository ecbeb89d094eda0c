#pragma once

#include "depthservo/robots/RobotModel.h"

namespace depthservo {

/// Twist of the camera by unit velocities of the robot; never on the heap.
using CameraJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 8>;

/// cVe eJe (6xn).
inline CameraJacobian cameraJacobian(const RobotModel& robot) {
  using RowMajor = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> cVe(robot.cVe().data, 6, 6);
  const Eigen::Map<const RowMajor> eJe(robot.eJe().data, 6, robot.eJe().getCols());
  return cVe.lazyProduct(eJe);
}

}  // namespace depthservo
