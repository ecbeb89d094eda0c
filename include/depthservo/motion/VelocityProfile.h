#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Velocities.h"

namespace depthservo {

/// Velocities until a time: v + amplitude sin(omega t + phase), component by component, t being the
/// time of the run. Empty vectors are zero.
struct VelocitySegment {
  double until = 0;           ///< [s]
  Eigen::VectorXd v;          ///< [m/s, rad/s]
  Eigen::VectorXd amplitude;  ///< of a swing on top [m/s, rad/s]
  Eigen::VectorXd omega;      ///< its angular frequency [rad/s]
  Eigen::VectorXd phase;      ///< [rad]
};

/// Velocities over the whole run; zero after the last segment.
using VelocityProfile = std::vector<VelocitySegment>;

/// The velocities of a profile at a time [s]. \param size how many there are, at most 8
DEPTHSERVO_API Velocities velocityAt(const VelocityProfile& profile, double time_s,
                                     Eigen::Index size);

/// Why this cannot be a profile of `size` velocities; empty: it can.
DEPTHSERVO_API std::string objection(const VelocityProfile& profile, std::size_t size);

}  // namespace depthservo
