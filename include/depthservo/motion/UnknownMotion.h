#pragma once

#include "depthservo/api.h"
#include "depthservo/motion/Twist.h"

namespace depthservo {

/// What nobody knows of a motion: for how long, and how far the camera may have gone meanwhile, in
/// any direction, from where the known parts of the motion put it.
struct UnknownPart {
  double duration_s = 0;  ///< [s]; 0: all is known
  double distance_m = 0;  ///< [m]
  double angle_rad = 0;   ///< [rad]

  bool exists() const { return duration_s > 0; }
};

/// How a camera may move while its odometry is missing. Depths then coast with a sigma that grows
/// as these bounds, which count as two sigma, allow; set those of your robot.
struct DEPTHSERVO_API UnknownMotion {
  double speed_mps = 1;              ///< greatest speed [m/s], >= 0; the last known one if higher
  double acceleration_mps2 = 2;      ///< greatest acceleration [m/s^2]; 0 or less: any
  double turnRate_rps = 1.5;         ///< greatest turn rate [rad/s], >= 0; likewise
  double turnAcceleration_rps2 = 6;  ///< greatest angular acceleration [rad/s^2]; 0 or less: any

  /// What is unknown of the time from `from_s` to `to_s` [s] after the last known twist. \rtsafe
  UnknownPart over(const Twist& last, double from_s, double to_s) const;
};

}  // namespace depthservo
