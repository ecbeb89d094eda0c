#pragma once

#include <limits>

#include "depthservo/api.h"
#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo {

/// A unicycle with a 3R arm that carries the camera at its tip, as in the simulation of De Luca,
/// Oriolo, Robuffo Giordano 2008, sec. 5.1; simulated without integration error.
///
/// Robot frame: in the middle of the wheel axle, x forward, y left, z up. The arm stands at `mount`
/// in it: a column turned by q1 about the vertical (counter-clockwise), then the upper arm raised
/// by q2 above the horizontal, then the forearm raised by q3 relative to it. At the tip the camera
/// looks along the forearm, its x axis horizontal. With all joints at zero the arm is stretched
/// out forward.
///
/// Commands are (v [m/s], w [rad/s], q1', q2', q3' [rad/s]). With e = q2 + q3, the reach
/// r = upperArm cos q2 + forearm cos e, (a, b) the velocity of the column's foot ahead and to the
/// left in the arm's plane, the camera twist is
///     vx = -b - r (w + q1'),   vy = sin e (a + r') - cos e h',   vz = cos e (a + r') + sin e h',
///     wx = q2' + q3',          wy = -cos e (w + q1'),            wz = sin e (w + q1'),
///     a = cos q1 (v - my w) + sin q1 mx w,   b = cos q1 mx w - sin q1 (v - my w),
///     r' = -upperArm sin q2 q2' - forearm sin e e',   h' = upperArm cos q2 q2' + forearm cos e e'.
///
/// The limits scale all five velocities by a common factor.
class DEPTHSERVO_API MobileManipulator : public SimulatedRobot {
 public:
  using Vector5d = Eigen::Matrix<double, 5, 1>;
  using Jacobian = Eigen::Matrix<double, 6, 5>;

  /// The paper does not give it. A column above the middle of the axle would make w and q1' the
  /// same to the camera.
  struct Geometry {
    Eigen::Vector3d mount{0.1, 0, 0.2};                     ///< foot of the column, robot frame [m]
    double column = 0.30, upperArm = 0.35, forearm = 0.30;  ///< lengths [m]
  };
  struct State {
    double x = 0, y = 0;  ///< [m]
    double theta = 0;     ///< heading, counter-clockwise from the world's x axis [rad]
    Eigen::Vector3d joints = Eigen::Vector3d::Zero();  ///< q1, q2, q3 [rad]
  };

  explicit MobileManipulator(const Geometry& geometry);

  void setState(const State& state);
  const State& state() const { return state_; }

  /// Greatest |v| [m/s], |w|, |q1'|, |q2'|, |q3'| [rad/s]; infinite by default.
  void setLimits(const Vector5d& limits) { limits_ = limits; }

  void accelerate(const Velocities& command, double dt) override;
  void move(double dt) override;
  Velocities velocity() const override { return velocity_; }
  Velocities velocityLimits() const override { return limits_; }
  std::vector<std::string> velocityNames() const override;
  Eigen::Vector3d floorPose() const override { return {state_.x, state_.y, state_.theta}; }
  Twist cameraTwist(const Velocities& velocity) const override;
  Eigen::Isometry3d wMc() const override { return wMcAt(state_); }

  /// 6x5; e is at the tip: x along the forearm, y left, z up. Changes with the joints.
  const DEPTHSERVO_VISP vpMatrix& eJe() const override { return eJe_; }
  const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const override { return cVe_; }  ///< constant

  /// Pose of the camera when the robot is in `state`.
  Eigen::Isometry3d wMcAt(const State& state) const;

  /// Camera twist by the five velocities (6x5), at the present joints.
  Jacobian cameraJacobian() const;

 private:
  Geometry geometry_;
  DEPTHSERVO_VISP vpMatrix eJe_;
  DEPTHSERVO_VISP vpVelocityTwistMatrix cVe_;
  State state_;
  Vector5d limits_ = Vector5d::Constant(std::numeric_limits<double>::infinity());
  Vector5d velocity_ = Vector5d::Zero();
};

}  // namespace depthservo
