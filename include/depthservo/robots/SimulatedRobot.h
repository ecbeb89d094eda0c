#pragma once

#include <Eigen/Geometry>

#include "depthservo/api.h"
#include "depthservo/robots/RobotModel.h"

namespace depthservo {

/// A robot that moves when it is told to, for simulations.
class DEPTHSERVO_API SimulatedRobot : public RobotModel {
 public:
  /// Moves for dt [s] with the command qdot (n velocities), after limits and actuators. A command
  /// that is not finite or of another size stops the robot. Returns the velocities really applied.
  Velocities drive(const Velocities& command, double dt) {
    accelerate(command, dt);
    move(dt);
    return velocity();
  }

  /// Takes the velocities to which limits and actuators bring this command within dt [s].
  virtual void accelerate(const Velocities& command, double dt) = 0;

  /// Moves for dt [s] with the velocities that it has.
  virtual void move(double dt) = 0;

  /// Where the robot is, from above: x, y [m] and direction [rad] in the world.
  virtual Eigen::Vector3d floorPose() const = 0;

  virtual Eigen::Isometry3d wMc() const = 0;  ///< pose of the camera in the world (z up)
};

}  // namespace depthservo
