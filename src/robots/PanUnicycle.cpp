#include "depthservo/robots/PanUnicycle.h"

#include <algorithm>
#include <cmath>

#include "depthservo/visp/using.h"
#include "robots/forwardCamera.h"
#include "robots/limits.h"
#include "robots/planarArc.h"

namespace depthservo {

PanUnicycle::PanUnicycle(const Geometry& geometry)
    : geometry_(geometry),
      eJe_(6, 3, 0.),
      cVe_(forwardCameraTwistMatrix({geometry.Cx, geometry.Cy, 0})) {
  eJe_[5][1] = eJe_[5][2] = 1;
  setState({});
}

void PanUnicycle::setState(const State& state) {
  state_ = state;
  const double c = std::cos(state.pan), s = std::sin(state.pan);
  eJe_[0][0] = c;
  eJe_[0][1] = s * geometry_.Dx;
  eJe_[1][0] = -s;
  eJe_[1][1] = c * geometry_.Dx;
}

Eigen::Isometry3d PanUnicycle::wMcAt(const State& state) const {
  const double a = state.theta + state.pan;
  const double c = std::cos(a), s = std::sin(a);
  const auto& [Dx, Cx, Cy, Cz] = geometry_;
  const Eigen::Vector3d position(state.x + Dx * std::cos(state.theta) + c * Cx - s * Cy,
                                 state.y + Dx * std::sin(state.theta) + s * Cx + c * Cy, Cz);
  return horizontalCamera(position, a);
}

Eigen::Matrix3d PanUnicycle::cameraJacobian() const {
  const double c = std::cos(state_.pan), s = std::sin(state_.pan);
  const auto& [Dx, Cx, Cy, Cz] = geometry_;
  Eigen::Matrix3d J;
  J << -s, Dx * c + Cx, Cx,  //
      c, Dx * s - Cy, -Cy,   //
      0, -1, -1;
  return J;
}

Eigen::Vector3d PanUnicycle::velocityFor(const Eigen::Vector3d& cameraMotion) const {
  const double c = std::cos(state_.pan), s = std::sin(state_.pan);
  const auto& [Dx, Cx, Cy, Cz] = geometry_;
  const double left = cameraMotion[0], forward = cameraMotion[1], turn = cameraMotion[2];
  const double w = (c * left + s * forward + (Cx * c - Cy * s) * turn) / Dx;
  return {-s * left + c * forward - (Cx * s + Cy * c) * turn, w, -turn - w};
}

Twist PanUnicycle::cameraTwist(const Velocities& velocity) const {
  const Eigen::Vector3d motion = cameraJacobian() * Eigen::Vector3d(velocity);
  return {{-motion[0], 0, motion[1]}, {0, motion[2], 0}};
}

Eigen::Vector3d PanUnicycle::limited(const Eigen::Vector3d& command, double dt) const {
  const Eigen::Vector3d wanted = command * commonFactor(command, limits_.velocity);
  const Eigen::Vector3d change = wanted - velocity_;
  return velocity_ + change * commonFactor(change, limits_.acceleration * dt);
}

void PanUnicycle::accelerate(const Velocities& command, double dt) {
  const bool isUsable = command.size() == 3 && command.allFinite();
  velocity_ = limited(isUsable ? Eigen::Vector3d(command) : Eigen::Vector3d::Zero(), dt);
}

void PanUnicycle::move(double dt) {
  const double pan = std::clamp(state_.pan + velocity_[2] * dt, limits_.pan_min, limits_.pan_max);
  if (pan != state_.pan + velocity_[2] * dt) velocity_[2] = (pan - state_.pan) / dt;
  const Eigen::Vector2d step = planarArc(velocity_[0] * dt, velocity_[1] * dt, state_.theta);
  setState({state_.x + step.x(), state_.y + step.y(), state_.theta + velocity_[1] * dt, pan});
}

}  // namespace depthservo
