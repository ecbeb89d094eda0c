#pragma once

#include <limits>

#include "depthservo/api.h"
#include "depthservo/robots/SimulatedRobot.h"

namespace depthservo {

/// Limits of a unicycle with a pan platform; infinite by default.
struct PanUnicycleLimits {
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  /// Greatest |v| [m/s], |w| [rad/s], |pan rate| [rad/s].
  Eigen::Vector3d velocity = Eigen::Vector3d::Constant(kNone);
  /// Greatest change of each per second [m/s^2, rad/s^2, rad/s^2].
  Eigen::Vector3d acceleration = Eigen::Vector3d::Constant(kNone);
  double pan_min = -kNone, pan_max = kNone;  ///< end stops of the joint [rad]
};

/// A unicycle with a camera on a pan platform, simulated without integration error (Durand
/// Petiteville, Courdesses, Cadenat 2010, eq. 3, 4, 12).
///
/// Robot frame: in the middle of the wheel axle, x forward, y left, z up. The pan axis stands at
/// (Dx, 0); the platform frame e on it, x forward, turned by `pan` counter-clockwise, carries the
/// camera at (Cx, Cy, Cz), optical axis along its x. Commands are (v [m/s], w [rad/s], pan rate
/// [rad/s]), the last relative to the base. With c = cos pan, s = sin pan the camera moves at
///     left      -s v + (Dx c + Cx) w + Cx panRate        (ViSP: -vx)
///     forward    c v + (Dx s - Cy) w - Cy panRate        (ViSP: vz)
///     about x_C      -(w + panRate)                      (ViSP: wy)
/// det J_r = Dx: with the axis ahead of the wheels all three are always at will.
///
/// The limits scale the three velocities by a common factor, so the camera keeps its direction; at
/// an end stop the joint alone stops.
class DEPTHSERVO_API PanUnicycle : public SimulatedRobot {
 public:
  struct Geometry {
    double Dx = 0.1;          ///< of the pan axis [m]
    double Cx = 0.1, Cy = 0;  ///< of the camera in the platform frame [m]
    double Cz = 0;            ///< height of the camera above the floor [m]
  };
  struct State {
    double x = 0, y = 0;  ///< [m]
    double theta = 0;     ///< heading, counter-clockwise from the world's x axis [rad]
    double pan = 0;       ///< [rad]
  };

  explicit PanUnicycle(const Geometry& geometry);

  void setState(const State& state);
  const State& state() const { return state_; }

  void setLimits(const PanUnicycleLimits& limits) { limits_ = limits; }

  void accelerate(const Velocities& command, double dt) override;
  void move(double dt) override;
  Velocities velocity() const override { return velocity_; }
  Velocities velocityLimits() const override { return limits_.velocity; }
  std::vector<std::string> velocityNames() const override {
    return {"v [m/s]", "w [rad/s]", "pan [rad/s]"};
  }
  Eigen::Vector3d floorPose() const override { return {state_.x, state_.y, state_.theta}; }
  Twist cameraTwist(const Velocities& velocity) const override;
  Eigen::Isometry3d wMc() const override { return wMcAt(state_); }
  const DEPTHSERVO_VISP vpMatrix& eJe() const override { return eJe_; }               ///< 6x3
  const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const override { return cVe_; }  ///< constant

  /// Pose of the camera when the robot is in `state`.
  Eigen::Isometry3d wMcAt(const State& state) const;

  /// J_r (3x3): camera (left, forward, turn rate about x_C) by (v, w, pan rate), at the present
  /// pan.
  Eigen::Matrix3d cameraJacobian() const;

  /// The velocities (v, w, pan rate) that move the camera so: J_r^-1 in closed form; needs Dx != 0.
  Eigen::Vector3d velocityFor(const Eigen::Vector3d& cameraMotion) const;

 private:
  Eigen::Vector3d limited(const Eigen::Vector3d& command, double dt) const;

  Geometry geometry_;
  DEPTHSERVO_VISP vpMatrix eJe_;
  DEPTHSERVO_VISP vpVelocityTwistMatrix cVe_;
  State state_;
  PanUnicycleLimits limits_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace depthservo
