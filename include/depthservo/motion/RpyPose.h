#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "depthservo/api.h"

namespace depthservo {

/// A pose in words: roll, pitch, yaw. Its rotation is Rz(yaw) Ry(pitch) Rx(roll); it maps
/// coordinates of the posed frame to the frame it is given in.
struct DEPTHSERVO_API RpyPose {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();  ///< [rad]

  Eigen::Isometry3d isometry() const;

  /// Where it looks straight up or down, yaw is 0.
  static RpyPose of(const Eigen::Isometry3d& pose);
};

}  // namespace depthservo
