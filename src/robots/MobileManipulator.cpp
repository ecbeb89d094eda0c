#include "depthservo/robots/MobileManipulator.h"

#include <cmath>

#include "depthservo/visp/using.h"
#include "robots/forwardCamera.h"
#include "robots/limits.h"
#include "robots/planarArc.h"

namespace depthservo {

MobileManipulator::MobileManipulator(const Geometry& geometry)
    : geometry_(geometry), eJe_(6, 5), cVe_(forwardCameraTwistMatrix(Eigen::Vector3d::Zero())) {
  setState({});
}

void MobileManipulator::setState(const State& state) {
  state_ = state;
  const Jacobian J = cameraJacobian();  // camera x, y, z: e's -y, -z, x
  for (unsigned column = 0; column < 5; ++column) {
    for (unsigned half = 0; half < 6; half += 3) {
      eJe_[half][column] = J(half + 2, column);
      eJe_[half + 1][column] = -J(half, column);
      eJe_[half + 2][column] = -J(half + 1, column);
    }
  }
}

Eigen::Isometry3d MobileManipulator::wMcAt(const State& state) const {
  const auto& [mount, column, upperArm, forearm] = geometry_;
  const double heading = state.theta + state.joints[0];
  const double raised = state.joints[1] + state.joints[2];
  const double reach = upperArm * std::cos(state.joints[1]) + forearm * std::cos(raised);
  const double rise = upperArm * std::sin(state.joints[1]) + forearm * std::sin(raised);
  const Eigen::Vector3d foot = Eigen::AngleAxisd(state.theta, Eigen::Vector3d::UnitZ()) * mount;
  const Eigen::Vector3d tip(state.x + foot.x() + reach * std::cos(heading),
                            state.y + foot.y() + reach * std::sin(heading),
                            foot.z() + column + rise);
  return horizontalCamera(tip, heading) * Eigen::AngleAxisd(raised, Eigen::Vector3d::UnitX());
}

MobileManipulator::Jacobian MobileManipulator::cameraJacobian() const {
  const auto& [mount, column, upperArm, forearm] = geometry_;
  const double c1 = std::cos(state_.joints[0]), s1 = std::sin(state_.joints[0]);
  const double c2 = std::cos(state_.joints[1]), s2 = std::sin(state_.joints[1]);
  const double e = state_.joints[1] + state_.joints[2];
  const double ce = std::cos(e), se = std::sin(e);
  const double reach = upperArm * c2 + forearm * ce, rise = upperArm * s2 + forearm * se;
  const double aheadByTurn = s1 * mount.x() - c1 * mount.y();
  const double leftByTurn = c1 * mount.x() + s1 * mount.y();
  Jacobian J;
  J.col(0) << s1, se * c1, ce * c1, 0, 0, 0;
  J.col(1) << -leftByTurn - reach, se * aheadByTurn, ce * aheadByTurn, 0, -ce, se;
  J.col(2) << -reach, 0, 0, 0, -ce, se;
  J.col(3) << 0, -se * rise - ce * reach, se * reach - ce * rise, 1, 0, 0;
  J.col(4) << 0, -forearm, 0, 1, 0, 0;
  return J;
}

std::vector<std::string> MobileManipulator::velocityNames() const {
  return {"v [m/s]", "w [rad/s]", "q1' [rad/s]", "q2' [rad/s]", "q3' [rad/s]"};
}

Twist MobileManipulator::cameraTwist(const Velocities& velocity) const {
  const Vector6d twist = cameraJacobian() * Vector5d(velocity);
  return {twist.head<3>(), twist.tail<3>()};
}

void MobileManipulator::accelerate(const Velocities& command, double dt) {
  if (!(dt > 0) || !std::isfinite(dt)) return;
  const bool isUsable = command.size() == 5 && command.allFinite();
  velocity_ = isUsable ? Vector5d(command) : Vector5d::Zero();
  velocity_ *= commonFactor(velocity_, limits_);
}

void MobileManipulator::move(double dt) {
  if (!(dt > 0) || !std::isfinite(dt)) return;
  const Eigen::Vector2d way = planarArc(velocity_[0] * dt, velocity_[1] * dt, state_.theta);
  setState({state_.x + way.x(), state_.y + way.y(), state_.theta + velocity_[1] * dt,
            state_.joints + velocity_.tail<3>() * dt});
}

}  // namespace depthservo
