#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/byLastingErrors.h"
#include "depth/motionOfExposures.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "motion/rateByTwist.h"

/// SharedErrorFilter: what the odometry does to the state.
namespace depthservo {
namespace {

using detail::covariance;
using detail::FilterPoint;
using detail::setCovariance;
using Phase = FilterPoint::Phase;

/// The told twist is averaged over this time [s] for what a latency does, since its noise also errs
/// in the motion itself and would pass for a latency (errors in variables). A change within the
/// noise is not followed at all; one far beyond it, as when a robot sets off, at once.
constexpr double kSteady_s = 0.5;
constexpr double kWithin = 3, kFarBeyond = 25;  // sigma

/// An instant is as long [s].
constexpr double kInstant_s = 1e-3;

/// Share of the square of a change that noise of so much in each component does not explain.
double beyond(double sigma, const Eigen::Vector3d& change) {
  const double squared = change.squaredNorm();
  return squared > 0 ? std::max(0., 1 - 3 * sigma * sigma / squared) : 0;
}

/// How much of a change of the twist's linear or angular part to follow. \param sigma of the noise
/// of each component
Eigen::Vector3d followed(const Eigen::Vector3d& change, double sigma, double dt) {
  const double squared = change.squaredNorm(), far = 3 * std::pow(kFarBeyond * sigma, 2);
  if (!(squared > 0)) return Eigen::Vector3d::Zero();
  const double ratio = far / squared;
  return beyond(kWithin * sigma, change) *
         std::max(std::min(1., dt / kSteady_s), 1 / (1 + ratio * ratio)) * change;
}

/// What of a change is left, as white noise: it lasts until the average has followed.
Eigen::Vector3d leftOver(const Eigen::Vector3d& change, const Eigen::Vector3d& followed,
                         double sigma, double dt) {
  const double times = GaussMarkov{1, kSteady_s}.asWhite(dt);
  return beyond(sigma, change) * std::sqrt(times) * (change - followed);
}

/// How much slip changes the speed from one image to the next [m/s].
double slipped(const GaussMarkov& slip, const Vector6d& twist, double dt) {
  const double kept = slip.kept(dt);
  return slip.sigma * std::sqrt(1 - kept * kept) * twist.head<3>().norm();
}

/// Latency and mount drift by this share of their prior in the root of a second: a lever between
/// the wheels and the camera, on which slip and scale act otherwise than on the wheels, is not
/// modelled.
constexpr double kDrift = 0.01;

/// The rotation by this vector.
Eigen::Matrix3d rotation(const Eigen::Vector3d& angle) {
  return Motion::fromTwist({Eigen::Vector3d::Zero(), -angle}, 1).R;
}

}  // namespace

/// A motion as the shared errors correct it.
struct SharedErrorFilter::Step {
  Motion motion;
  Twist twist;                                          // mean, corrected
  Vector6d change = Vector6d::Zero();                   // of the told twist, less noise
  Vector6d behind = Vector6d::Zero();                   // what is left of it, as white noise
  Eigen::Matrix3d mount = Eigen::Matrix3d::Identity();  // R(m)'
  double missing_s = 0;  // share of t_d for which there is no odometry
};

Coverage SharedErrorFilter::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {  // the first image: nothing to move yet
    if (!std::isfinite(time_s)) return Coverage::reversed;
    time_s_ = time_s;
    return Coverage::complete;
  }
  const Coverage coverage = odometry.coverage(time_s_, time_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) return coverage;
  if (hasMotion(coverage)) {
    predict(stepTo(odometry, time_s));
  } else {  // empty, beforeStart: how the camera moved will never be known
    steady_.setConstant(std::numeric_limits<double>::quiet_NaN());
    behind_.setZero();
    for (std::size_t i = 0; i < size_; ++i) {
      Slot& slot = slots_[i];
      unseat(slot);
      if (slot.isStarted) slot.prior = {1 / range_.clampChi(slot.point.chi)};
      slot.isStarted = false;
    }
  }
  time_s_ = time_s;
  return coverage;
}

SharedErrorFilter::Step SharedErrorFilter::stepTo(const MotionBuffer& odometry, double time_s) {
  Step step;
  const auto exposures = detail::motionOfExposures(odometry, time_s_, time_s, value(latency_));
  step.motion = exposures.motion;
  step.missing_s = exposures.missing_s;
  Motion& motion = step.motion;
  if (!(motion.dt > 0)) return step;
  if (latency_ != kNone) followTwist(odometry, time_s_ - exposures.offset_s, step);
  if (bias_ != kNone) detail::takeOutBias(motion, values_.segment<3>(bias_));
  motion.t *= 1 + value(slip_) + value(scale_);
  if (mount_ != kNone) {
    const Eigen::Matrix3d mount = rotation(-values_.segment<3>(mount_));
    step.mount = mount;
    motion.R = mount * motion.R * mount.transpose();
    motion.t = mount * motion.t;
  }
  step.twist = motion.twist();
  return step;
}

/// The told twist from the last exposure to this one. \param begin_s time of the last one
void SharedErrorFilter::followTwist(const MotionBuffer& odometry, double begin_s, Step& step) {
  const Motion& motion = step.motion;
  const Vector6d now = motion.twist().vector();
  if (!steady_.allFinite()) {
    const auto before = odometry.meanTwist(begin_s - kInstant_s, begin_s);
    steady_ = before.coverage == Coverage::complete ? before.twist.vector() : now;
  }
  const ErrorProfile& e = options_.errors;
  const OdometryNoise::Step noise = e.odometry.over(motion);
  const double dt = motion.dt;
  const auto sigma = [dt](double variance, const NoiseLevel& ofPoses) {
    return std::sqrt(variance + 2 * ofPoses.sigma() * ofPoses.sigma()) / dt;
  };
  const double sigma_v =
      std::hypot(sigma(noise.variance_t, position_), slipped(reckoned_, now, dt));
  const double sigma_w = sigma(noise.variance_theta, angle_);
  const Vector6d change = now - steady_;
  step.change << followed(change.head<3>(), sigma_v, dt), followed(change.tail<3>(), sigma_w, dt);
  step.behind << leftOver(change.head<3>(), step.change.head<3>(), sigma_v, dt),
      leftOver(change.tail<3>(), step.change.tail<3>(), sigma_w, dt);
}

/// d(x, y, chi) after the step by the shared states before it.
SharedErrorFilter::ByShared SharedErrorFilter::bySharedErrors(const Step& step,
                                                              const FilterPoint& before,
                                                              const PointState& after,
                                                              const Eigen::Matrix3d& F) const {
  ByShared C = ByShared::Zero(3, shared_);
  const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
  const double dt = step.motion.dt;
  if (latency_ != kNone) C.col(latency_) = -(L * step.change);
  if (bias_ != kNone) C.middleCols<3>(bias_) = -dt * L.rightCols<3>() * step.mount;
  if (mount_ != kNone) C.middleCols<3>(mount_) = dt * detail::byMount(L, step.twist);
  const Eigen::Vector3d byScale = detail::byScale({before.x, before.y, before.chi}, F, after);
  if (scale_ != kNone) C.col(scale_) = byScale;
  if (slip_ != kNone) C.col(slip_) = byScale / (1 + values_(slip_) + value(scale_));
  return C;
}

void SharedErrorFilter::predict(const Step& step) {
  const Motion& motion = step.motion;
  if (!motion.isFinite() || !(motion.dt > 0) || !step.change.allFinite()) return;
  const ErrorProfile& e = options_.errors;
  noise_ = e.odometry.over(motion);
  dt_ = motion.dt;
  twist_ = step.twist;
  steady_ += step.change;
  behind_ = step.behind;
  if (motion.unknown.exists()) {  // each point on its own then
    for (std::size_t i = 0; i < size_; ++i) unseat(slots_[i]);
  }
  // What points alone have no state for counts as noise.
  const double slipped = slip_ == kNone ? 0 : std::sqrt(P_(slip_, slip_)) * motion.t.norm();
  const double variance_alone = noise_.variance_t + slipped * slipped * e.slip.asWhite(dt_);
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    FilterPoint& p = slot.point;
    if (!slot.isStarted || p.phase == Phase::behind) continue;
    const PointState before{p.x, p.y, p.chi};
    const auto [after, isAhead] = flow(motion, before);
    const double size = std::abs(after.x) + std::abs(after.y) + std::abs(after.chi);
    if (!isAhead || !(size < detail::kLargestState)) {
      unseat(slot);
      p.phase = Phase::behind;
      continue;
    }
    Eigen::Matrix3d F = flowJacobian(motion, before, after);
    const ByShared C = bySharedErrors(step, p, after, F);
    p.parallax2 = F(0, 2) * F(0, 2) + F(1, 2) * F(1, 2);
    F.block<2, 1>(0, 2) *= noise_.rho;
    p.x = after.x;
    p.y = after.y;
    p.chi = after.chi;
    if (latency_ != kNone) {
      p.x += C(0, latency_) * step.missing_s;
      p.y += C(1, latency_) * step.missing_s;
      p.chi += C(2, latency_) * step.missing_s;
    }
    const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
    if (slot.place != kNone) {
      F_[slot.place] = F;
      C_[slot.place] = C;
      G_[slot.place] << std::sqrt(noise_.variance_t) * L.leftCols<3>(),
          std::sqrt(noise_.variance_theta) * L.rightCols<3>();
      p.phase = Phase::coasting;
      continue;
    }
    const Eigen::Matrix3d P =
        F * covariance(p) * F.transpose() +
        variance_alone * L.leftCols<3>() * L.leftCols<3>().transpose() +
        noise_.variance_theta * L.rightCols<3>() * L.rightCols<3>().transpose();
    setCovariance(p, P);
    slot.A = F * slot.A + C.leftCols(constants_);
    if (p.phase != Phase::adrift) p.phase = Phase::coasting;
    if (motion.unknown.exists()) letDrift(slot, motion.unknown);
  }
  propagate();
  keepSound();
}

/// P <- Phi P Phi' + Q, as twice P <- (P Phi')', then what the processes forget and add.
void SharedErrorFilter::propagate() {
  const int n = rows();
  for (int pass = 0; pass < 2; ++pass) {
    for (int place = 0; place < places_; ++place) {
      if (seated_[place] == kNone) continue;
      const int p = row(place);
      const Eigen::Matrix3d& F = F_[place];
      const ByShared& C = C_[place];
      for (int i = 0; i < 3; ++i) {
        auto to = W_.col(i).head(n);
        to = F(i, 0) * P_.col(p).head(n) + F(i, 1) * P_.col(p + 1).head(n) +
             F(i, 2) * P_.col(p + 2).head(n);
        for (int k = 0; k < shared_; ++k) {
          if (C(i, k) != 0) to += C(i, k) * P_.col(k).head(n);
        }
      }
      P_.block(0, p, n, 3) = W_.topRows(n);
    }
    P_.topLeftCorner(n, n).transposeInPlace();
  }
  for (int i = 0; i < places_; ++i) {
    for (int j = 0; j < places_; ++j) {
      if (seated_[i] != kNone && seated_[j] != kNone) {
        P_.block<3, 3>(row(i), row(j)) += G_[i] * G_[j].transpose();
      }
    }
  }
  const ErrorProfile& e = options_.errors;
  for (int i = 0; i < constants_; ++i) {
    const double sigma = kDrift * priorOf(i);
    if (i == latency_ || isMount(i)) P_(i, i) += sigma * sigma * dt_;
  }
  if (slip_ != kNone) renew(slip_, reckoned_.kept(dt_), reckoned_.sigma);
  if (jitter_ != kNone) renew(jitter_, 0, e.jitter_s);
  for (int place = 0; place < places_; ++place) {
    Slot* slot = slotAt(place);
    if (!slot) continue;
    const int p = row(place);
    for (int i = 3; i < perPoint_; ++i) {
      renew(p + i, e.wander_px.kept(dt_), e.wander_px.sigma / options_.focal_px);
      slot->wander(i - 3) *= e.wander_px.kept(dt_);
    }
  }
}

/// A Gauss-Markov state goes on: keeps this much of itself, and its variance is refilled.
void SharedErrorFilter::renew(int index, double kept, double sigma) {
  const int n = rows();
  P_.row(index).head(n) *= kept;
  P_.col(index).head(n) *= kept;
  P_(index, index) += sigma * sigma * (1 - kept * kept);
  if (index < shared_) values_(index) *= kept;
}

/// What a part of the motion that is not known does to a point alone.
void SharedErrorFilter::letDrift(Slot& slot, const UnknownPart& unknown) {
  FilterPoint total = described(slot, kNone);
  detail::letDrift(total, unknown);
  slot.point = total;
  slot.A.setZero();
}

}  // namespace depthservo
