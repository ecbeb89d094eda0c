#pragma once

#include <visp3/core/vpVelocityTwistMatrix.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "depthservo/visp/visp.h"
#include "visp/pose.h"

namespace depthservo {

/// Pose in the world of a camera whose horizontal optical axis points at the angle `heading` [rad],
/// counter-clockwise from the world's x axis (z up).
inline Eigen::Isometry3d horizontalCamera(const Eigen::Vector3d& position, double heading) {
  const double c = std::cos(heading), s = std::sin(heading);
  Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
  wMc.linear() << s, 0, c,  //
      -c, 0, s,             //
      0, -1, 0;
  wMc.translation() = position;
  return wMc;
}

/// cVe of a camera at `offset` in the frame e (x forward, y left, z up), looking forward.
inline DEPTHSERVO_VISP vpVelocityTwistMatrix
forwardCameraTwistMatrix(const Eigen::Vector3d& offset) {
  const Eigen::Isometry3d eMc = horizontalCamera(offset, 0);
  return DEPTHSERVO_VISP vpVelocityTwistMatrix(toVisp(eMc.inverse()));
}

}  // namespace depthservo
