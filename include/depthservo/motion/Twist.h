#pragma once

#include <Eigen/Core>

namespace depthservo {

using Vector6d = Eigen::Matrix<double, 6, 1>;  ///< (linear, angular), as a Twist
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Velocity of the camera, expressed in the camera frame (x right, y down, z forward).
///
/// The order of the six components is (vx, vy, vz, wx, wy, wz), as in ViSP. A point of the scene
/// that stands still moves in the camera frame as dp/dt = -linear - angular x p.
struct Twist {
  /// Beyond any robot, and a thousandth of what estimators bear.
  static constexpr double kLargestSpeed_mps = 1e4, kLargestTurnRate_rps = 1e4;

  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< [m/s]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< [rad/s]

  Vector6d vector() const { return (Vector6d() << linear, angular).finished(); }
  bool isFinite() const { return linear.allFinite() && angular.allFinite(); }

  /// Finite, and no faster than the largest.
  bool isUsable() const {
    return linear.norm() <= kLargestSpeed_mps && angular.norm() <= kLargestTurnRate_rps;
  }
};

}  // namespace depthservo
