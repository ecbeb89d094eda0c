#pragma once

#include <visp3/core/vpMatrix.h>
#include <visp3/core/vpVelocityTwistMatrix.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "depthservo/motion/Twist.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// A simulated robot that carries a camera, as a servo loop sees it: it is driven by n velocities
/// qdot, and the camera's twist is cVe eJe qdot.
class CameraRobot {
 public:
  virtual ~CameraRobot() = default;

  /// Moves for dt [s] with the command qdot (n velocities), after limits and actuators. A command
  /// that is not finite or of another size stops the robot. Returns the velocities really applied.
  virtual Eigen::VectorXd drive(const Eigen::VectorXd& command, double dt) = 0;

  /// Velocities applied by the last `drive`; n zeros before.
  virtual Eigen::VectorXd velocity() const = 0;

  /// Greatest size of each velocity, n; infinite where there is no limit.
  virtual Eigen::VectorXd velocityLimits() const = 0;

  /// What the n velocities are, with their units: "v [m/s]".
  virtual std::vector<std::string> velocityNames() const = 0;

  /// Where the robot is, from above: x, y [m] and direction [rad] in the world.
  virtual Eigen::Vector3d floorPose() const = 0;

  /// Camera twist at the velocities qdot, in the camera frame.
  virtual Twist cameraTwist(const Eigen::VectorXd& velocity) const = 0;

  virtual Eigen::Isometry3d wMc() const = 0;         ///< pose of the camera in the world (z up)
  virtual DEPTHSERVO_VISP vpMatrix eJe() const = 0;  ///< 6xn
  virtual DEPTHSERVO_VISP vpVelocityTwistMatrix cVe() const = 0;  ///< 6x6
};

}  // namespace depthservo
