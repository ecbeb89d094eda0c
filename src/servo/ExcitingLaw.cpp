#include "servo/ExcitingLaw.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "features/pointInteraction.h"
#include "robots/limits.h"

namespace depthservo {
namespace {

constexpr double kVague = 0.1, kKnown = 0.05;  // sigma_Z / Z to begin and to end
constexpr double kTurns_Hz = 0.5;
constexpr double kImmobile = 1e-6;  // m/s of the camera across its axis, by 1 m/s or 1 rad/s

/// Share of what the robot can, at most.
constexpr double kShare = 0.5;

/// Share of the limit for the displacement by the motion itself.
constexpr double kOwn = 1. / 3;

/// With less than this share of a step left within the limit it is time to turn back.
constexpr double kBlocked = 0.1;

constexpr double kShortest_s = 1e-6;  // between two images

/// As the robot does: all by a common factor.
Velocities within(const Velocities& limits, const Velocities& velocity) {
  return velocity * commonFactor(velocity, limits);
}

/// Greatest share of the step, at most 1, that leads no farther than `reach` from the origin or
/// than one is already.
double shareWithin(const Eigen::Vector2d& at, const Eigen::Vector2d& step, double reach) {
  const double a = step.squaredNorm(), b = at.dot(step);
  const double c = std::min(0., at.squaredNorm() - reach * reach);
  if (a == 0) return 1;
  return std::clamp((std::sqrt(b * b - a * c) - b) / a, 0., 1.);
}

/// Of all velocities of the robot that move the camera across its axis as wanted [m/s], those by
/// which the points move least. \param task (2N x 6)
Velocities gentlest(const CameraJacobian& J, const Eigen::MatrixXd& task,
                    const Eigen::Vector2d& wanted) {
  const Eigen::MatrixXd across = J.topRows<2>();
  const Velocities velocity = across.completeOrthogonalDecomposition().solve(wanted);
  const Eigen::MatrixXd byVelocity = task * J, free = across.fullPivLu().kernel();
  const Eigen::MatrixXd byFree = byVelocity * free;
  return velocity - free * byFree.completeOrthogonalDecomposition().solve(byVelocity * velocity);
}

}  // namespace

ExcitingLaw::ExcitingLaw(std::unique_ptr<ControlLaw> law, const LawSetup& setup,
                         const PointFeatures& features)
    : law_(std::move(law)),
      features_(features),
      speed_(setup.control.excite->speed),
      reach_(kOwn * setup.control.excite->limit / setup.camera.focal_px()),
      period_s_(setup.framePeriod_s) {}

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

Velocities ExcitingLaw::command(const ControlInput& now) {
  const Velocities limits = now.robot.velocityLimits();
  const Velocities command = within(limits, law_->command(now));
  const double dt = lastTime_s_ < 0 ? period_s_ : std::max(kShortest_s, now.time_s - lastTime_s_);
  lastTime_s_ = now.time_s;
  carryAlong(now.robot, dt);
  const CameraJacobian J = cameraJacobian(now.robot);
  isOn_ = isNeeded() && !J.topRows<2>().isZero(kImmobile);
  const auto step = [&](const Velocities& added) -> Vector6d {
    return dt * (J * (within(limits, command + added) - command));
  };
  added_ = Velocities::Zero(command.size());
  if (isOn_) {
    added_ = limited(excitation(J, dt), J, limits);
    const double share = shareWithinLimit(step(added_));
    isReturning_ |= share < kBlocked;
    added_ *= share;
  } else {
    isReturning_ = !law_->usesFeatures();
  }
  if (isReturning_) {
    const Velocities back = J.completeOrthogonalDecomposition().solve(-displacement_ / dt);
    added_ = limited(back, J, limits);
    isReturning_ = added_ != back;
  }
  displacement_ += step(added_);
  return within(limits, command + added_);
}

std::optional<Velocities> ExcitingLaw::between(const ControlInput& now) {
  const std::optional<Velocities> command = law_->between(now);
  if (!command || added_.size() == 0) return command;
  const Velocities limits = now.robot.velocityLimits();
  return within(limits, within(limits, *command) + added_);
}

void ExcitingLaw::carryAlong(const RobotModel& robot, double dt) {
  const Twist twist = robot.cameraTwist(robot.velocity());
  const Eigen::Vector3d way = displacement_.head<3>(), turn = displacement_.tail<3>();
  displacement_.head<3>() -= dt * (twist.angular.cross(way) + twist.linear.cross(turn));
  displacement_.tail<3>() -= dt * twist.angular.cross(turn);
}

Velocities ExcitingLaw::excitation(const CameraJacobian& J, double dt) {
  Eigen::MatrixXd task(2 * static_cast<Eigen::Index>(features_.size()), 6);
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate& e = features_[i].estimate();
    task.middleRows<2>(static_cast<Eigen::Index>(2 * i)) = pointInteraction({e.x, e.y, e.chi});
  }
  phase_ += 2 * M_PI * kTurns_Hz * dt;
  return gentlest(J, task, {speed_ * std::cos(phase_), speed_ * std::sin(phase_)});
}

Velocities ExcitingLaw::limited(const Velocities& velocity, const CameraJacobian& J,
                                const Velocities& limits) const {
  const double speed = (J * velocity).head<3>().norm();
  const Velocities slow = velocity * std::min(1., speed_ / std::max(speed, 1e-9));
  return within(kShare * limits, slow);
}

double ExcitingLaw::shareWithinLimit(const Vector6d& step) const {
  double share = 1;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate& e = features_[i].estimate();
    for (const double sign : {-1., 1.}) {
      const double chi = std::max(0., e.chi + sign * 2 * e.sigma_chi);
      const Eigen::Matrix<double, 2, 6> L = pointInteraction({e.x, e.y, chi});
      share = std::min(share, shareWithin(L * displacement_, L * step, reach_));
    }
  }
  return share;
}

const char* ExcitingLaw::activity() const {
  return isOn_ ? "active excitation: the camera moves to learn the depths" : "";
}

}  // namespace depthservo
