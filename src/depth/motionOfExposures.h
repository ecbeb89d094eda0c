#pragma once

#include <algorithm>

#include "depthservo/motion/MotionBuffer.h"

namespace depthservo::detail {

/// The motion between two exposures, which are earlier than the stamps.
struct MotionOfExposures {
  Motion motion;
  double offset_s = 0;   ///< by which it is earlier than that between the stamps
  double missing_s = 0;  ///< share of the latency for which there is no odometry
};

/// \param latency_s of both stamps t0 and t1. What is not known yet must wait, but for what never
/// will be. \rtsafe
inline MotionOfExposures motionOfExposures(const MotionBuffer& odometry, double t0_s, double t1_s,
                                           double latency_s) {
  const bool isComplete = odometry.coverage(t0_s, t1_s) == Coverage::complete;
  double offset_s = isComplete ? std::max(latency_s, t1_s - odometry.end()) : latency_s;
  MotionBuffer::Interval interval = odometry.motion(t0_s - offset_s, t1_s - offset_s);
  if (!hasMotion(interval.coverage)) {
    offset_s = 0;
    interval = odometry.motion(t0_s, t1_s);
  }
  return {interval.motion, offset_s, latency_s - offset_s};
}

/// Takes the bias of the angular velocity [rad/s] out of a motion: half of it before, half after,
/// exact to second order. \rtsafe
inline void takeOutBias(Motion& motion, const Eigen::Vector3d& bias) {
  const Eigen::Matrix3d half =
      Motion::fromTwist({Eigen::Vector3d::Zero(), -bias}, 0.5 * motion.dt).R;
  motion.R = half * motion.R * half;
  motion.t = half * motion.t;
}

}  // namespace depthservo::detail
