#include "depthservo/depth/SharedErrorFilter.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

using detail::FilterPoint;
using detail::Verdict;
using Phase = FilterPoint::Phase;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// The twist's change is taken from means over this time at least [s]. Shorter ones hold noise of
/// the rows that also errs in the motion itself and would pass for a latency (errors in variables).
constexpr double kStretch_s = 0.25;

/// Images without a point at a place before another may take it.
constexpr int kPatience = 3;

/// Latency and mount drift by this share of their prior in the root of a second: a lever between
/// the wheels and the camera, on which slip and scale act otherwise than on the wheels, is not
/// modelled.
constexpr double kDrift = 0.01;

/// States beyond this are not numbers to work with.
constexpr double kLargestState = 1e6;

/// The shared constants stay within this many sigma of their priors.
constexpr double kFarthest = 6;

Vector6d stacked(const Twist& twist) {
  Vector6d u;
  u << twist.linear, twist.angular;
  return u;
}

Eigen::Matrix3d covariance(const FilterPoint& p) {
  Eigen::Matrix3d P;
  P << p.xx, p.xy, p.xc, p.xy, p.yy, p.yc, p.xc, p.yc, p.cc;
  return P;
}

void setCovariance(FilterPoint& p, const Eigen::Matrix3d& P) {
  p.xx = P(0, 0);
  p.xy = P(1, 0);
  p.xc = P(2, 0);
  p.yy = P(1, 1);
  p.yc = P(2, 1);
  p.cc = P(2, 2);
}

double nisOf(const Eigen::Matrix2d& S, const Eigen::Vector2d& nu) {
  const double det = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0);
  const double scaled =
      S(1, 1) * nu(0) * nu(0) - 2 * S(0, 1) * nu(0) * nu(1) + S(0, 0) * nu(1) * nu(1);
  return det > 0 ? scaled / det : std::numeric_limits<double>::infinity();
}

/// The rotation by this vector.
Eigen::Matrix3d rotation(const Eigen::Vector3d& angle) {
  return Motion::fromTwist({Eigen::Vector3d::Zero(), -angle}, 1).R;
}

}  // namespace

/// A motion as the shared errors correct it.
struct SharedErrorFilter::Step {
  Motion motion;
  Twist twist;                                          // mean, corrected
  Vector6d acceleration = Vector6d::Zero();             // of the twist
  Eigen::Matrix3d mount = Eigen::Matrix3d::Identity();  // R(m)'
  double missing_s = 0;  // share of t_d for which there is no odometry
};

SharedErrorFilter::SharedErrorFilter(std::size_t capacity, const Options& options,
                                     const DepthPrior& prior, const DepthRange& range)
    : options_(options), prior_(prior), range_(range), slots_(capacity) {
  const ErrorProfile& e = options_.errors;
  const auto add = [this](int& index, bool isWanted, int count = 1) {
    if (!isWanted) return;
    index = shared_;
    shared_ += count;
  };
  add(latency_, e.latency_s > 0);
  add(bias_, e.gyroBias_rad_s > 0, 3);
  add(mount_, e.mount_rad > 0, 3);
  add(focal_, e.focal > 0);
  add(scale_, e.scale > 0);
  constants_ = shared_;
  add(slip_, e.slip.sigma > 0);
  add(jitter_, e.jitter_s > 0);
  if (e.wander_px.sigma > 0) perPoint_ = 5;

  pointOptions_.odometry = e.odometry;
  pointOptions_.gate = options_.gate;
  pointOptions_.rejectionsInARow = options_.rejectionsInARow;
  pointOptions_.huber = options_.huber;
  pointOptions_.lost_sigma = options_.lost_sigma;

  const std::size_t places = std::min(options_.places, capacity);
  seated_.resize(places);
  const Eigen::Index most = row(static_cast<int>(places));
  values_.resize(shared_);
  before_.resize(constants_);
  P_.resize(most, most);
  U_.resize(most, 2);
  K_.resize(most, 2);
  W_.resize(most, 3);
  G_.resize(places);
  F_.resize(places);
  C_.assign(places, ByShared::Zero(3, shared_));
  for (Slot& slot : slots_) slot.A = ByConstants::Zero(3, constants_);
  reset();
}

std::unique_ptr<PointSetEstimator> SharedErrorFilter::clone() const {
  return std::make_unique<SharedErrorFilter>(*this);
}

void SharedErrorFilter::reset() {
  size_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  places_ = 0;
  std::fill(seated_.begin(), seated_.end(), kNone);
  resetShared();
  twist_ = {};
  noise_ = {};
  dt_ = 0;
}

void SharedErrorFilter::resetShared() {
  const ErrorProfile& e = options_.errors;
  values_.setZero();
  before_.setZero();
  P_.setZero();
  const auto prior = [this](int index, double sigma, int count = 1) {
    if (index == kNone) return;
    P_.diagonal().segment(index, count).setConstant(sigma * sigma);
  };
  prior(latency_, e.latency_s);
  prior(bias_, e.gyroBias_rad_s, 3);
  prior(mount_, e.mount_rad, 3);
  prior(focal_, e.focal);
  prior(scale_, e.scale);
  prior(slip_, e.slip.sigma);
  prior(jitter_, e.jitter_s);
  nisSum_ = 2;
  nisWeight_ = 1;
}

// --- Slots

const SharedErrorFilter::Slot* SharedErrorFilter::find(int id) const {
  const auto end = slots_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto slot = std::find_if(slots_.begin(), end, [id](const Slot& s) { return s.id == id; });
  return slot == end ? nullptr : &*slot;
}

SharedErrorFilter::Slot* SharedErrorFilter::findOrAdd(int id) {
  if (const Slot* known = find(id)) return &slots_[static_cast<std::size_t>(known - slots_.data())];
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot.id = id;
  slot.isStarted = false;
  slot.place = kNone;
  slot.unseen = 0;
  slot.prior = prior_;
  slot.point = {};
  slot.A.setZero();
  return &slot;
}

bool SharedErrorFilter::setPrior(int id, const DepthPrior& prior) {
  Slot* slot = findOrAdd(id);
  if (!slot) return false;
  unseat(*slot);
  slot->prior = prior;
  slot->isStarted = false;
  return true;
}

bool SharedErrorFilter::retire(int id) {
  const Slot* known = find(id);
  if (!known) return false;
  const auto index = static_cast<std::size_t>(known - slots_.data());
  unseat(slots_[index]);
  slots_[index] = slots_[--size_];
  if (index < size_ && slots_[index].place != kNone) {
    seated_[slots_[index].place] = static_cast<int>(index);
  }
  return true;
}

// --- Prediction

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

SharedErrorFilter::Step SharedErrorFilter::stepTo(const MotionBuffer& odometry,
                                                  double time_s) const {
  Step step;
  const double wanted = value(latency_);
  // What is not known yet must wait, but for what never will be.
  const bool isComplete = odometry.coverage(time_s_, time_s) == Coverage::complete;
  double offset = isComplete ? std::max(wanted, time_s - odometry.end()) : wanted;
  auto interval = odometry.motion(time_s_ - offset, time_s - offset);
  if (!hasMotion(interval.coverage)) {
    offset = 0;
    interval = odometry.motion(time_s_, time_s);
  }
  step.motion = interval.motion;
  step.missing_s = wanted - offset;
  Motion& motion = step.motion;
  if (!(motion.dt > 0)) return step;
  if (latency_ != kNone) {
    const double stretch = std::max(kStretch_s, motion.dt), end_s = time_s - offset;
    const auto late = odometry.meanTwist(end_s - stretch, end_s);
    const auto early = odometry.meanTwist(end_s - 2 * stretch, end_s - stretch);
    if (early.coverage == Coverage::complete && late.coverage == Coverage::complete) {
      step.acceleration = (stacked(late.twist) - stacked(early.twist)) / stretch;
    }
  }
  if (bias_ != kNone) {  // half of it before, half after: exact to second order
    const Eigen::Matrix3d half = rotation(0.5 * motion.dt * values_.segment<3>(bias_));
    motion.R = half * motion.R * half;
    motion.t = half * motion.t;
  }
  motion.t *= 1 + value(slip_);
  if (mount_ != kNone) {
    const Eigen::Matrix3d mount = rotation(-values_.segment<3>(mount_));
    step.mount = mount;
    motion.R = mount * motion.R * mount.transpose();
    motion.t = mount * motion.t;
  }
  step.twist = motion.twist();
  return step;
}

/// d(x, y, chi) after the step by the shared states before it.
SharedErrorFilter::ByShared SharedErrorFilter::bySharedErrors(const Step& step,
                                                              const FilterPoint& before,
                                                              const PointState& after,
                                                              const Eigen::Matrix3d& F) const {
  ByShared C = ByShared::Zero(3, shared_);
  const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
  const double dt = step.motion.dt;
  if (latency_ != kNone) C.col(latency_) = -dt * (L * step.acceleration);
  if (bias_ != kNone) C.middleCols<3>(bias_) = -dt * L.rightCols<3>() * step.mount;
  if (mount_ != kNone) {  // du/dm_i = (v x e_i, w x e_i)
    const auto cross = [](const Eigen::Vector3d& a) {
      Eigen::Matrix3d m;
      m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
      return m;
    };
    C.middleCols<3>(mount_) = dt * (L.leftCols<3>() * cross(step.twist.linear) +
                                    L.rightCols<3>() * cross(step.twist.angular));
  }
  const Eigen::Vector3d byScale = before.chi * F.col(2) - Eigen::Vector3d(0, 0, after.chi);
  if (scale_ != kNone) C.col(scale_) = byScale;
  if (slip_ != kNone) C.col(slip_) = byScale / (1 + values_(slip_));
  return C;
}

void SharedErrorFilter::predict(const Step& step) {
  const Motion& motion = step.motion;
  if (!motion.isFinite() || !(motion.dt > 0) || !step.acceleration.allFinite()) return;
  const ErrorProfile& e = options_.errors;
  noise_ = e.odometry.over(motion);
  dt_ = motion.dt;
  twist_ = step.twist;
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
    if (!isAhead || !(size < kLargestState)) {
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
    if (slot.place != kNone) {
      const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
      F_[slot.place] = F;
      C_[slot.place] = C;
      G_[slot.place] << std::sqrt(noise_.variance_t) * L.leftCols<3>(),
          std::sqrt(noise_.variance_theta) * L.rightCols<3>();
      p.phase = Phase::coasting;
      continue;
    }
    const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
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

/// Points whose numbers have failed start anew; so does all if those of the shared errors have.
void SharedErrorFilter::keepSound() {
  const auto isSound = [](const auto& variances) {
    return variances.allFinite() && (variances.array() >= 0).all() &&
           (variances.array() < detail::kLargestVariance).all();
  };
  const bool isShared = values_.allFinite() && isSound(P_.diagonal().head(shared_));
  if (!isShared) {
    std::fill(seated_.begin(), seated_.end(), kNone);
    places_ = 0;
    resetShared();
  }
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (!slot.isStarted) continue;
    FilterPoint& p = slot.point;
    const bool isState = std::abs(p.x) + std::abs(p.y) + std::abs(p.chi) < kLargestState;
    const bool isKept = isShared || slot.place == kNone;
    if (isKept && isState && isSound(covariance(described(slot, slot.place)).diagonal().eval())) {
      continue;
    }
    if (slot.place != kNone && isShared) vacate(slot);
    slot.place = kNone;
    slot.A.setZero();
    const double chi = range_.clampChi(p.chi);
    p = {};
    p.chi = chi;
    p.xx = p.yy = 1;
    p.cc = DepthPrior::kWideSigma_chi * DepthPrior::kWideSigma_chi;
    p.phase = Phase::behind;
  }
}

void SharedErrorFilter::vacate(Slot& slot) {
  seated_[slot.place] = kNone;
  clear(row(slot.place), perPoint_);
  slot.place = kNone;
  while (places_ > 0 && seated_[places_ - 1] == kNone) --places_;
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
  if (slip_ != kNone) renew(slip_, e.slip.kept(dt_), e.slip.sigma);
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

// --- Correction

void SharedErrorFilter::correct(const std::vector<PointObservation>& observations) {
  for (std::size_t i = 0; i < size_; ++i) ++slots_[i].unseen;
  const auto each = [&](const auto& use) {
    for (const PointObservation& observation : observations) {
      if (Slot* slot = findOrAdd(observation.id)) use(*slot, observation.measurement);
    }
  };
  each([this](Slot& slot, const PointMeasurement& measured) {
    if (!slot.isStarted || slot.place == kNone) return;
    slot.unseen = 0;
    correctSeated(slot, measured);
  });
  symmetrise();
  moveAlone();
  each([this](Slot& slot, const PointMeasurement& measured) {
    if (slot.isStarted && slot.unseen == 0) return;
    if (!slot.isStarted && !measured.isUsable()) return;
    slot.unseen = 0;
    if (!slot.isStarted) return start(slot, measured, slot.prior);
    correctAlone(slot, measured);
  });
  keepSound();
  elect();
}

/// The points alone follow what has been learnt of the constants.
void SharedErrorFilter::moveAlone() {
  for (int i = 0; i < constants_; ++i) {
    const double limit = kFarthest * priorOf(i);
    values_(i) = std::clamp(values_(i), -limit, limit);
  }
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (slot.place != kNone || !slot.isStarted) continue;
    Eigen::Vector3d by = Eigen::Vector3d::Zero();
    for (int k = 0; k < constants_; ++k) by += (values_(k) - before_(k)) * slot.A.col(k);
    slot.point.x += by(0);
    slot.point.y += by(1);
    slot.point.chi += by(2);
  }
  before_ = values_.head(constants_);
}

SharedErrorFilter::Seen SharedErrorFilter::seen(const Slot& slot) const {
  const FilterPoint& p = slot.point;
  const Eigen::Matrix<double, 2, 6> L = rateByTwist({p.x, p.y, p.chi}).topRows<2>();
  const Eigen::Vector2d xy(p.x, p.y), rate = L * stacked(twist_);
  Seen seen;
  seen.byShared.setZero(2, shared_);
  seen.point = kappa() * xy;
  if (focal_ != kNone) seen.byShared.col(focal_) = xy;
  if (jitter_ != kNone) {
    seen.byShared.col(jitter_) = -rate;
    seen.point -= rate * values_(jitter_);
  }
  const ErrorProfile& e = options_.errors;
  const GaussMarkov pose{1, e.poseTau_s};
  const double white = dt_ > 0 ? pose.asWhite(dt_) : 1;
  seen.byPose =
      white * (e.position_m * e.position_m * L.leftCols<3>() * L.leftCols<3>().transpose() +
               e.angle_rad * e.angle_rad * L.rightCols<3>() * L.rightCols<3>().transpose());
  seen.point += rate * (e.readout_s * options_.imageRow(p.y));
  return seen;
}

void SharedErrorFilter::start(Slot& slot, const PointMeasurement& measurement,
                              const DepthPrior& prior) {
  unseat(slot);
  const double scale = 1 / kappa();
  FilterPoint& p = slot.point;
  detail::resetPoint(p, {scale * measurement.x, scale * measurement.y, scale * measurement.sigma},
                     prior.sanitised(range_));
  slot.isStarted = true;
  slot.A.setZero();
  if (focal_ != kNone) slot.A.col(focal_) = Eigen::Vector3d(-scale * p.x, -scale * p.y, 0);
  const Eigen::Matrix2d more = othersAsNoise(seen(slot), 1);
  p.xx += more(0, 0);
  p.xy += more(1, 0);
  p.yy += more(1, 1);
}

/// Covariance of a measurement by what a point alone has no state for.
/// \param wander how many times its variance counts
Eigen::Matrix2d SharedErrorFilter::othersAsNoise(const Seen& seen, double wander) const {
  const double sigma = options_.errors.wander_px.sigma / options_.focal_px;
  Eigen::Matrix2d noise = seen.byPose + wander * sigma * sigma * Eigen::Matrix2d::Identity();
  for (int i = constants_; i < shared_; ++i) {
    for (int j = constants_; j < shared_; ++j) {
      noise += P_(i, j) * seen.byShared.col(i) * seen.byShared.col(j).transpose();
    }
  }
  return noise;
}

void SharedErrorFilter::correctSeated(Slot& slot, const PointMeasurement& measurement) {
  FilterPoint& point = slot.point;
  if (!measurement.isUsable()) {
    point.phase = Phase::rejected;
    return;
  }
  const int n = rows(), p = row(slot.place);
  const Seen s = seen(slot);
  // U = P H', the covariance of the state and the measurement.
  const double k = kappa();
  for (int i = 0; i < 2; ++i) {
    auto u = U_.col(i).head(n);
    u = k * P_.col(p + i).head(n);
    if (perPoint_ > 3) u += P_.col(p + 3 + i).head(n);
    for (int j = 0; j < shared_; ++j) {
      if (s.byShared(i, j) != 0) u += s.byShared(i, j) * P_.col(j).head(n);
    }
  }
  Eigen::Matrix2d HPH = k * U_.block<2, 2>(p, 0) + s.byShared.lazyProduct(U_.topRows(shared_));
  Eigen::Vector2d expected = s.point;
  if (perPoint_ > 3) {
    HPH += U_.block<2, 2>(p + 3, 0);
    expected += slot.wander;
  }
  HPH += s.byPose;
  const double r = detail::measurementVariance(measurement.sigma);
  const Eigen::Vector2d nu = Eigen::Vector2d(measurement.x, measurement.y) - expected;
  const double nis = nisOf(HPH + r * Eigen::Matrix2d::Identity(), nu);
  switch (detail::judge(point, nis, pointOptions_)) {
    case Verdict::restart:
      start(slot, measurement, {1 / range_.clampChi(point.chi)});
      return;
    case Verdict::reject:
      point.phase = Phase::rejected;
      return;
    case Verdict::use:
      break;
  }
  constexpr double kMemory = 1 - 1. / 200;  // values
  nisSum_ = kMemory * nisSum_ + std::min(nis, options_.gate);
  nisWeight_ = kMemory * nisWeight_ + 1;
  const Eigen::Matrix2d S =
      HPH + detail::weighted(r, nis, pointOptions_) * Eigen::Matrix2d::Identity();
  K_.topRows(n) = U_.topRows(n).lazyProduct(S.inverse());
  if (scale_ != kNone) K_.row(scale_).setZero();  // considered: no image can tell it
  apply(nu, n);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_(i, i);
    P_.col(i).head(n) -= U_(i, 0) * K_.col(0).head(n) + U_(i, 1) * K_.col(1).head(n);
    P_(i, i) = std::max(P_(i, i), least);
  }
  if (scale_ != kNone) P_.row(scale_).head(n) = P_.col(scale_).head(n).transpose();
  point.r = r;
  point.phase = Phase::measured;
}

/// Adds K nu to the state.
void SharedErrorFilter::apply(const Eigen::Vector2d& nu, int n) {
  const auto by = [&](int index) { return K_(index, 0) * nu(0) + K_(index, 1) * nu(1); };
  for (int i = 0; i < shared_; ++i) values_(i) += by(i);
  for (int place = 0; row(place) < n; ++place) {
    Slot* slot = slotAt(place);
    if (!slot) continue;
    const int p = row(place);
    slot->point.x += by(p);
    slot->point.y += by(p + 1);
    slot->point.chi += by(p + 2);
    for (int i = 3; i < perPoint_; ++i) slot->wander(i - 3) += by(p + i);
  }
}

void SharedErrorFilter::symmetrise() {
  const int n = rows();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) P_(i, j) = P_(j, i) = 0.5 * (P_(i, j) + P_(j, i));
  }
}

void SharedErrorFilter::correctAlone(Slot& slot, const PointMeasurement& measurement) {
  FilterPoint& p = slot.point;
  if (!measurement.isUsable()) {
    if (p.phase != Phase::behind && p.phase != Phase::adrift) p.phase = Phase::rejected;
    return;
  }
  if (p.phase == Phase::adrift) {
    const double scale = 1 / kappa();
    detail::rejoinPoint(p,
                        {scale * measurement.x, scale * measurement.y, scale * measurement.sigma});
    return;
  }
  const Seen s = seen(slot);
  const double k = kappa(), r = detail::measurementVariance(measurement.sigma);
  const Eigen::Matrix2d noise = othersAsNoise(s, options_.errors.wander_px.asWhite(dt_));
  const Eigen::Matrix3d P = covariance(p);
  const Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostConstants> G =
      k * slot.A.topRows<2>() + s.byShared.leftCols(constants_);
  const Eigen::Matrix2d own = k * k * P.topLeftCorner<2, 2>() + noise, byConstants = ofConstants(G);
  const Eigen::Vector2d nu = Eigen::Vector2d(measurement.x, measurement.y) - s.point;
  const double nis = nisOf(own + byConstants + r * Eigen::Matrix2d::Identity(), nu);
  switch (detail::judge(p, nis, pointOptions_)) {
    case Verdict::restart:
      start(slot, measurement, {1 / range_.clampChi(p.chi)});
      return;
    case Verdict::reject:
      p.phase = Phase::rejected;
      return;
    case Verdict::use:
      break;
  }
  const Eigen::Matrix2d S =
      own + detail::weighted(r, nis, pointOptions_) * Eigen::Matrix2d::Identity();
  const Eigen::Matrix<double, 3, 2> U = k * P.leftCols<2>(), K = U * S.inverse();
  const Eigen::Vector3d by = K * nu;
  p.x += by(0);
  p.y += by(1);
  p.chi += by(2);
  Eigen::Matrix3d left = P - K * U.transpose();
  left.diagonal() = left.diagonal().cwiseMax(detail::kLeastShare * P.diagonal());
  setCovariance(p, left);
  slot.A -= K * G;
  p.r = r;
  p.phase = Phase::measured;
}

void SharedErrorFilter::correctDepth(int id, const DepthPrior& measured) {
  const Slot* known = find(id);
  if (!known || !known->isStarted || !measured.isUsable()) return;
  Slot& slot = slots_[static_cast<std::size_t>(known - slots_.data())];
  FilterPoint& point = slot.point;
  const double chi = range_.clampChi(1 / measured.Z);
  const double variance = detail::depthVariance(chi, measured.sigma_chi);
  if (slot.place == kNone) {
    const double sum = point.cc + variance;
    const Eigen::Vector3d K = covariance(point).col(2) / sum;
    detail::correctPointDepth(point, measured, range_);
    slot.A -= K * slot.A.row(2);
    return;
  }
  // It may tell the scale, too.
  const int n = rows(), c = row(slot.place) + 2;
  const double sum = P_(c, c) + variance, nu = chi - point.chi;
  U_.col(0).head(n) = P_.col(c).head(n);
  K_.col(0).head(n) = U_.col(0).head(n) / sum;
  K_.col(1).head(n).setZero();
  apply({nu, 0}, n);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_(i, i);
    P_.col(i).head(n) -= U_(i, 0) * K_.col(0).head(n);
    P_(i, i) = std::max(P_(i, i), least);
  }
  moveAlone();
}

// --- Which points learn the shared errors

void SharedErrorFilter::clear(int first, int count) {
  P_.middleRows(first, count).setZero();
  P_.middleCols(first, count).setZero();
}

/// A point alone takes a place.
void SharedErrorFilter::seat(Slot& slot, int place) {
  slot.place = place;
  seated_[place] = static_cast<int>(&slot - slots_.data());
  places_ = std::max(places_, place + 1);
  const int p = row(place), n = rows();
  clear(p, perPoint_);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < constants_; ++k) {
      if (slot.A(i, k) != 0) P_.col(p + i).head(n) += slot.A(i, k) * P_.col(k).head(n);
    }
  }
  P_.block<3, 3>(p, p) = covariance(described(slot, kNone));
  P_.middleRows(p, 3).leftCols(p) = P_.middleCols(p, 3).topRows(p).transpose();
  P_.block(p, p + 3, 3, n - p - 3) = P_.block(p + 3, p, n - p - 3, 3).transpose();
  slot.wander.setZero();
  const double wander = options_.errors.wander_px.sigma / options_.focal_px;
  for (int i = 3; i < perPoint_; ++i) P_(p + i, p + i) = wander * wander;
}

/// The point goes on alone: what its error shares with the constants becomes its sensitivity.
void SharedErrorFilter::unseat(Slot& slot) {
  if (slot.place == kNone) return;
  const int p = row(slot.place), c = constants_;
  slot.A.setZero();
  Eigen::Matrix3d P = P_.block<3, 3>(p, p);
  if (c > 0) {
    using Constants =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostConstants, kMostConstants>;
    const Constants constants = P_.topLeftCorner(c, c);
    ByConstants shared(3, c);
    shared = P_.block(p, 0, 3, c);
    slot.A = constants.ldlt().solve(shared.transpose()).transpose();
    if (!slot.A.allFinite()) slot.A.setZero();
    P -= slot.A * shared.transpose();
  }
  P.diagonal() = P.diagonal().cwiseMax(detail::kLeastShare * P_.diagonal().segment<3>(p));
  setCovariance(slot.point, P);
  vacate(slot);
}

void SharedErrorFilter::elect() {
  // Squared distance in the image to the nearest seated point: points far apart tell more.
  const auto spread = [this](const Slot& slot) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int place = 0; place < places_; ++place) {
      const Slot* other = slotAt(place);
      if (!other) continue;
      const double dx = slot.point.x - other->point.x, dy = slot.point.y - other->point.y;
      nearest = std::min(nearest, dx * dx + dy * dy);
    }
    return nearest;
  };
  const auto isCandidate = [](const Slot& slot) {
    return slot.isStarted && slot.place == kNone && slot.point.phase == Phase::measured;
  };
  for (std::size_t place = 0; place < seated_.size(); ++place) {
    const auto at = static_cast<int>(place);
    Slot* holder = slotAt(at);
    if (holder && holder->unseen <= kPatience) continue;
    Slot* best = nullptr;
    double bestSpread = -1;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!isCandidate(slots_[i])) continue;
      const double s = spread(slots_[i]);
      if (s <= bestSpread) continue;
      best = &slots_[i];
      bestSpread = s;
    }
    if (!best) return;
    if (holder) unseat(*holder);
    seat(*best, at);
  }
}

// --- Reports

FilterPoint SharedErrorFilter::described(const Slot& slot, int place) const {
  FilterPoint point = slot.point;
  Eigen::Matrix3d P;
  if (place == kNone) {
    P = covariance(point) + ofConstants(slot.A);
  } else {
    P = P_.block<3, 3>(row(place), row(place));
  }
  setCovariance(point, P);
  return point;
}

DepthEstimate SharedErrorFilter::estimate(int id) const {
  const Slot* slot = find(id);
  if (!slot || !slot->isStarted) {
    const DepthPrior prior = (slot ? slot->prior : prior_).sanitised(range_);
    DepthEstimate unset;
    unset.chi = 1 / prior.Z;
    unset.sigma_chi = prior.sigma_chi;
    return unset;
  }
  DepthEstimate e =
      detail::describePoint(described(*slot, slot->place), noise_, dt_, pointOptions_, range_);
  e.x *= kappa();
  e.y *= kappa();
  return e;
}

double SharedErrorFilter::priorOf(int index) const {
  const ErrorProfile& e = options_.errors;
  return index == latency_ ? e.latency_s
         : index == focal_ ? e.focal
         : index == scale_ ? e.scale
         : isMount(index)  ? e.mount_rad
                           : e.gyroBias_rad_s;
}

SharedErrorFilter::Shared SharedErrorFilter::shared(int index, double prior) const {
  if (index == kNone) return {};
  return {values_(index), std::sqrt(std::max(P_(index, index), 0.)), prior};
}

SharedErrorFilter::Shared SharedErrorFilter::latency() const {
  return shared(latency_, options_.errors.latency_s);
}

SharedErrorFilter::Shared SharedErrorFilter::gyroBias(int axis) const {
  return shared(bias_ == kNone ? kNone : bias_ + axis, options_.errors.gyroBias_rad_s);
}

SharedErrorFilter::Shared SharedErrorFilter::mount(int axis) const {
  return shared(mount_ == kNone ? kNone : mount_ + axis, options_.errors.mount_rad);
}

SharedErrorFilter::Shared SharedErrorFilter::focal() const {
  return shared(focal_, options_.errors.focal);
}

SharedErrorFilter::Shared SharedErrorFilter::slip() const {
  return shared(slip_, options_.errors.slip.sigma);
}

}  // namespace depthservo
