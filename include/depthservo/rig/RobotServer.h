#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <string>

#include "depthservo/api.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/rig/DurationHistogram.h"
#include "depthservo/rig/SimulatedRigOptions.h"

namespace depthservo {

struct RobotServerOptions {
  std::string images, twist, command;  ///< pipes; those that are not there are made
  std::string log;                     ///< CSV of what is true, by row of odometry; may be empty
  /// Time goes on when the command of an image has come; else as the wall's clock does.
  bool isLockstep = false;
  double wait_s = 30;                       ///< for somebody who reads the images; for a command
  const std::atomic<bool>* stop = nullptr;  ///< once it is true the run ends; may be null
};

/// What a simulated robot has to say at its end.
struct RobotServerReport {
  std::size_t images = 0, dropped = 0;    ///< written; not written since nobody took the last
  std::size_t droppedAtStart = 0;         ///< of these, before the first command to move
  std::size_t rows = 0;                   ///< of odometry
  std::size_t commands = 0, refused = 0;  ///< taken; not to be used
  std::size_t watchdogStops = 0;          ///< times that it stopped for want of a command
  double duration_s = 0;                  ///< of its own clock
  /// From the time of an image to the arrival of the first command that follows from it, for each
  /// that had one; real time only.
  DurationHistogram latency;
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();  ///< x, y [m], theta [rad] at the end
  Velocities velocity;                             ///< then
  double goalError_px = 0;  ///< rms distance of the points to those seen from robot.goal; NaN: none
  std::string whyEnded;     ///< a sentence
};

/// A simulated robot as a process of its own: images out, twists out, commands in. It knows nothing
/// of a control law. In real time its stamps are the system's clock.
///
/// Commands are taken when a row of odometry begins, as base controllers do: rate 100 or more. One
/// that is older than its time to live, by its stamp or since it came, is none: the robot brakes by
/// limits.brake_v, brake_w. The drives themselves can do that; who commands keeps to dv, dw.
class DEPTHSERVO_API RobotServer {
 public:
  /// \param place of the options, for messages \throw InputError
  RobotServer(const SimulatedRigOptions& rig, const RobotServerOptions& options,
              const std::string& place = "");
  ~RobotServer();

  /// Until the duration is over, or whoever commands has gone and the robot stands.
  RobotServerReport run();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
