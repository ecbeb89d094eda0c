#include "servo/ExcitingLaw.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "features/pointInteraction.h"
#include "robots/cameraJacobian.h"

namespace depthservo {
namespace {

constexpr double kVague = 0.1, kKnown = 0.05;  // sigma_Z / Z to begin and to end
constexpr double kTurns_Hz = 0.5;

/// Share of the speed that the null space must have to be used.
constexpr double kEnough = 0.5;

}  // namespace

ExcitingLaw::ExcitingLaw(std::unique_ptr<ControlLaw> law, const Scenario& scenario,
                         const FeaturePointGroup& features)
    : law_(std::move(law)),
      features_(features),
      speed_(scenario.control.excite->speed),
      limit_(scenario.control.excite->limit / scenario.camera.pinhole().focal_px()),
      period_s_(1 / scenario.camera.rate.front()) {}

bool ExcitingLaw::isNeeded() const {
  bool isVague = false, isKnown = true;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate& e = features_[i].estimate();
    if (e.status == DepthStatus::lost || e.status == DepthStatus::unset) return false;
    const double relative = e.sigma_chi / e.chi;
    const bool isLearnt = e.status == DepthStatus::unexcited || e.status == DepthStatus::converging;
    isVague |= isLearnt && relative > kVague;
    isKnown &= relative < kKnown;
  }
  return isOn_ ? !isKnown : isVague;
}

Eigen::VectorXd ExcitingLaw::command(const ControlInput& now) {
  const Eigen::VectorXd command = law_->command(now);
  const double dt = lastTime_s_ < 0 ? period_s_ : now.time_s - lastTime_s_;
  lastTime_s_ = now.time_s;
  isOn_ = isNeeded();
  return isOn_ ? Eigen::VectorXd(command + excitation(now, dt)) : command;
}

Eigen::VectorXd ExcitingLaw::excitation(const ControlInput& now, double dt) {
  const Eigen::MatrixXd J = cameraJacobian(now.robot);
  phase_ += 2 * M_PI * kTurns_Hz * dt;
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(6);
  wanted.head<2>() << speed_ * std::cos(phase_), speed_ * std::sin(phase_);
  Eigen::VectorXd velocity = J.completeOrthogonalDecomposition().solve(wanted);

  Eigen::MatrixXd task(2 * static_cast<Eigen::Index>(features_.size()), 6);
  double largestChi = 0;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate& e = features_[i].estimate();
    task.middleRows<2>(static_cast<Eigen::Index>(2 * i)) = pointInteraction({e.x, e.y, e.chi});
    largestChi = std::max(largestChi, e.chi + 2 * e.sigma_chi);
  }
  const Eigen::MatrixXd byVelocity = task * J;
  const Eigen::VectorXd still =
      velocity - byVelocity.completeOrthogonalDecomposition().solve(byVelocity * velocity);
  const double stillSpeed = (J * still).head<3>().norm();
  if (stillSpeed > kEnough * speed_) return still * (speed_ / stillSpeed);

  const Eigen::Vector3d moved = (J * velocity).head<3>();
  velocity *= std::min(1., speed_ / std::max(moved.norm(), 1e-9));
  const double reach = limit_ / largestChi, way = moved.norm() * dt;
  const double next = (displacement_ + dt * moved).norm();
  if (next > reach && next > displacement_.norm()) {
    velocity *= std::clamp((reach - displacement_.norm()) / std::max(way, 1e-12), 0., 1.);
  }
  displacement_ += dt * (J * velocity).head<3>();
  return velocity;
}

std::string ExcitingLaw::state() const {
  return isOn_ ? "active excitation: the camera moves to learn the depths" : "";
}

}  // namespace depthservo
