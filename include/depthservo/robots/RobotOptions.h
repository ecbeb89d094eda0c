#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/RpyPose.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/text/Refuse.h"

namespace depthservo {

/// Robots that carry the camera: unicycle | pan-unicycle | omni | mobile-manipulator | free.
enum class RobotKind { unicycle, panUnicycle, omni, mobileManipulator, free };

/// Where a robot is.
struct RobotPose {
  double x = 0, y = 0;                               ///< on the floor [m]
  double theta = 0;                                  ///< [rad], from world x towards y
  double pan = 0;                                    ///< of the pan platform [rad]
  Eigen::Vector3d joints = Eigen::Vector3d::Zero();  ///< q1, q2, q3 of the arm [rad]
  RpyPose camera;                                    ///< of a free camera, wMc
};

struct RobotLimits {
  double v = 0.5;                        ///< [m/s]
  double w = 1;                          ///< [rad/s]
  double dv = 1;                         ///< [m/s^2]
  double dw = 2;                         ///< [rad/s^2]
  double brake_v = 4, brake_w = 8;       ///< of safety stops only [m/s^2, rad/s^2]
  double pan = 1;                        ///< rate of the pan platform [rad/s]
  double pan_min = -3.2, pan_max = 3.2;  ///< its end stops [rad]
  double joints = 1;                     ///< rate of each joint of the arm [rad/s]
};

/// Of a mobile manipulator; the camera at its tip looks along the forearm.
struct ArmOptions {
  Eigen::Vector3d mount{0.1, 0, 0.2};                    ///< foot of the column, robot frame [m]
  double column = 0.3, upper_arm = 0.35, forearm = 0.3;  ///< lengths [m]
};

/// A time in which something is otherwise.
struct Interlude {
  double from = 0, to = 0;  ///< [s], from < to

  bool covers(double time_s) const { return time_s >= from && time_s < to; }
};

struct RobotOptions {
  RobotKind type = RobotKind::unicycle;
  Eigen::Vector3d camera_offset = Eigen::Vector3d::Zero();  ///< robot frame: x forward, z up [m]
  double camera_yaw = 0;                                    ///< optical axis, about robot z [rad]
  /// Of the camera's true frame in the one assumed: Rz(yaw) Ry(pitch) Rx(roll) [rad]; simulated
  /// error; the estimator is not informed.
  Eigen::Vector3d mount_error = Eigen::Vector3d::Zero();
  double mount_drawn = 0;  ///< 1 sigma of each of them, drawn by the seed and added [rad]
  double pan_axis = 0.1;   ///< of the pan platform, ahead of the wheel axle [m]
  ArmOptions arm;
  RobotPose initial;
  std::optional<RobotPose> goal;  ///< this or control.desired
  RobotLimits limits;
  double lag = 0;        ///< time constant of the drives [s]; 0: none
  double dead_time = 0;  ///< from a command to the drives, of the simulated robot [s]
  std::vector<Interlude> stuck;  ///< the drives of the simulated robot follow no command then
};

/// Limits of each velocity of a robot, n.
struct RobotVelocityLimits {
  Velocities velocity, acceleration, braking;
};
DEPTHSERVO_API RobotVelocityLimits velocityLimits(RobotKind robot, const RobotLimits& limits);

/// What does not fit together, and what this robot does not have.
DEPTHSERVO_API void check(const RobotOptions& robot, const Refuse& refuse);

}  // namespace depthservo
