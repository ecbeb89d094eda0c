#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/findById.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "motion/rateByTwist.h"

/// SharedErrorFilter: what an image does to the state.
namespace depthservo {
namespace {

using detail::covariance;
using detail::FilterPoint;
using detail::setCovariance;
using detail::Verdict;
using Phase = FilterPoint::Phase;

/// The shared constants stay within this many sigma of their priors.
constexpr double kMostSigmas = 6;

/// Measurements over which their innovations are averaged.
constexpr double kRemembered = 200;

/// Over which slip is compared with the profile's [s], and from how many sigma it is larger.
constexpr double kSlipMemory_s = 10, kSlipEvidence = 3;

/// Wheels that slip more drive another way [-].
constexpr double kMostSlip = 0.5;

double nisOf(const Eigen::Matrix2d& S, const Eigen::Vector2d& nu) {
  return detail::nisOf(S(0, 0), S(0, 1), S(1, 1), nu(0), nu(1));
}

/// Variance as white noise for a point that has been seen for so long. What lasts is about the same
/// as when the point was first seen: only its change since then errs in the depth. Of a motion at
/// constant speed the slope of n places has white noise 12 s^2 / (n T^2), and with what has changed
/// like a random walk of 2 s^2 T / tau it has 2.4 s^2 / (tau T): with each image that is as much as
/// 0.6 T^2 / (tau dt) times white noise tells, until it is what counts for long.
double asWhite(const NoiseLevel& noise, double dt, double age_s) {
  const GaussMarkov& lasting = noise.lasting;
  const double variance = lasting.sigma * lasting.sigma;
  if (!(dt > 0) || !(lasting.tau_s > 0)) return noise.white * noise.white + variance;
  const double young = 0.6 * age_s * age_s / (lasting.tau_s * dt);
  return noise.white * noise.white +
         std::clamp(young, 1., std::max(1., lasting.asWhite(dt))) * variance;
}

}  // namespace

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
  if (slip_ != kNone && options_.isCautious) learnSlip();
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
    const double limit = kMostSigmas * priorOf(i);
    const double middle = calibrated(i);
    values_(i) = std::clamp(values_(i), middle - limit, middle + limit);
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

/// If slip has the variance V that is reckoned with and P is left of it, the square of its estimate
/// is V - P on the mean. By what it is more, V is too small, which shows as much as the images
/// tell.
void SharedErrorFilter::learnSlip() {
  const double V = reckoned_.sigma * reckoned_.sigma, value = values_(slip_);
  const double told = V - P_(slip_, slip_), usual = options_.errors.slip.sigma;
  if (!(told > 0)) return;
  const double weight = dt_ * (told / V) * (told / V), keep = std::exp(-dt_ / kSlipMemory_s);
  slipTold_s_ = keep * slipTold_s_ + weight;
  slipSum_ = keep * slipSum_ + weight * V + dt_ * (value * value - told);
  const double variance = slipSum_ / slipTold_s_;
  const double independent = slipTold_s_ / (reckoned_.asWhite(dt_) * dt_);
  const double chance = 1 + kSlipEvidence * std::sqrt(2 / independent);
  const bool isMore = variance > usual * usual * chance;
  reckoned_.sigma = isMore ? std::min(std::sqrt(variance), kMostSlip) : usual;
  const double more = reckoned_.sigma * reckoned_.sigma - V;
  if (more > 0) forgetSlipped(more);
}

/// Until now slip had so much more variance: by its mean over the time for which they have been
/// seen all points err together, as by a scale.
void SharedErrorFilter::forgetSlipped(double more) {
  const double lasts_s = reckoned_.asWhite(dt_) * dt_;
  const auto off = [&](const Slot& slot) {
    return slot.point.chi * std::sqrt(more * std::min(1., lasts_s / (time_s_ - slot.first_s)));
  };
  P_(slip_, slip_) += more;
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (slot.isStarted && slot.place == kNone) slot.point.cc += off(slot) * off(slot);
  }
  for (int i = 0; i < places_; ++i) {
    for (int j = 0; j < places_; ++j) {
      if (slotAt(i) && slotAt(j)) P_(row(i) + 2, row(j) + 2) += off(*slotAt(i)) * off(*slotAt(j));
    }
  }
}

SharedErrorFilter::Seen SharedErrorFilter::seen(const Slot& slot) const {
  const FilterPoint& p = slot.point;
  const Eigen::Matrix<double, 2, 6> L = rateByTwist({p.x, p.y, p.chi}).topRows<2>();
  const Eigen::Vector2d xy(p.x, p.y), rate = L * twist_.vector();
  Seen seen;
  seen.byShared.setZero(2, shared_);
  seen.point = kappa() * xy;
  if (focal_ != kNone) seen.byShared.col(focal_) = xy;
  if (jitter_ != kNone) {
    seen.byShared.col(jitter_) = -rate;
    seen.point -= rate * values_(jitter_);
  }
  const ErrorProfile& e = options_.errors;
  const double age_s = time_s_ - slot.first_s;
  seen.byPose = asWhite(position_, dt_, age_s) * L.leftCols<3>() * L.leftCols<3>().transpose() +
                asWhite(angle_, dt_, age_s) * L.rightCols<3>() * L.rightCols<3>().transpose();
  if (latency_ != kNone && options_.isCautious) {
    const Eigen::Vector2d unfollowed = L * behind_;
    seen.byPose += P_(latency_, latency_) * unfollowed * unfollowed.transpose();
  }
  seen.point += rate * (e.readout_s * (options_.rowScale * p.y + options_.rowOffset));
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
  slot.first_s = time_s_;
  slot.A.setZero();
  if (focal_ != kNone) slot.A.col(focal_) = Eigen::Vector3d(-scale * p.x, -scale * p.y, 0);
  const Eigen::Matrix2d more = othersAsNoise(seen(slot), 1);
  p.xx += more(0, 0);
  p.xy += more(1, 0);
  p.yy += more(1, 1);
  slot.noise = dt_ > 0 ? noiseOf(slot) : 0;  // in the first image it is not known yet
}

/// Of a measurement of the point, as white noise, mean of both axes.
double SharedErrorFilter::noiseOf(const Slot& slot) const {
  Seen old = seen(slot);
  const Eigen::Matrix<double, 2, 6> L =
      rateByTwist({slot.point.x, slot.point.y, slot.point.chi}).topRows<2>();
  old.byPose = position_.asWhite(dt_) * L.leftCols<3>() * L.leftCols<3>().transpose() +
               angle_.asWhite(dt_) * L.rightCols<3>() * L.rightCols<3>().transpose();
  return slot.point.r + 0.5 * othersAsNoise(old, options_.errors.wander_px.asWhite(dt_)).trace();
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
  const Eigen::Matrix2d whole = HPH + r * Eigen::Matrix2d::Identity();
  const double nis = nisOf(whole, nu);
  cost_ += 0.5 * (std::min(nis, options_.gate) + std::log(std::max(whole.determinant(), 1e-300)));
  const Verdict verdict = detail::judge(point, nis, pointOptions_);
  const int isRejected = verdict == Verdict::use ? 0 : 1;
  rejected_ += isRejected;
  rejectedShare_ += (isRejected - rejectedShare_) / kRemembered;
  if (verdict == Verdict::restart) {
    return start(slot, measurement, {1 / range_.clampChi(point.chi)});
  }
  if (verdict == Verdict::reject) {
    point.phase = Phase::rejected;
    return;
  }
  constexpr double kMemory = 1 - 1 / kRemembered;
  ++nisValues_;
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
  Slot* known = detail::findById(slots_, size_, id);
  if (!known || !known->isStarted || !measured.isUsable()) return;
  Slot& slot = *known;
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

}  // namespace depthservo
