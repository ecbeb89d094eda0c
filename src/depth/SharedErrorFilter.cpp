#include "depthservo/depth/SharedErrorFilter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/findById.h"

namespace depthservo {
namespace {

using detail::covariance;
using detail::FilterPoint;
using detail::setCovariance;
using Phase = FilterPoint::Phase;

/// Images without a point at a place before another may take it.
constexpr int kLongestAbsence = 3;

/// Over which a point forgets that there was more noise [s].
constexpr double kNoiseForgotten_s = 1;

}  // namespace

SharedErrorFilter::SharedErrorFilter(std::size_t capacity, const Options& options,
                                     const DepthPrior& prior, const DepthRange& range)
    : options_(options), prior_(prior), range_(range), slots_(capacity) {
  const ErrorProfile& e = options_.errors;
  position_ = MeasurementNoise::of(e).position_m;
  angle_ = MeasurementNoise::of(e).angle_rad;
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
  steady_.setConstant(std::numeric_limits<double>::quiet_NaN());
  behind_.setZero();
  noise_ = {};
  dt_ = 0;
}

/// Wander that is not in the profile has no states and stays out.
void SharedErrorFilter::setNoise(const MeasurementNoise& noise) {
  position_ = noise.position_m;
  angle_ = noise.angle_rad;
  if (perPoint_ > 3) options_.errors.wander_px = noise.pixel_px.lasting;
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (!slot.isStarted || slot.point.phase != Phase::measured || !(dt_ > 0)) continue;
    const double now = noiseOf(slot);
    if (slot.noise > 0 && now > slot.noise) inflate(slot, now / slot.noise);
    slot.noise = std::max(now, slot.noise * std::exp(-dt_ / kNoiseForgotten_s));
  }
}

/// What was learnt with too little noise is less certain by so much.
void SharedErrorFilter::inflate(Slot& slot, double times) {
  constexpr double kMost = DepthPrior::kWideSigma_chi * DepthPrior::kWideSigma_chi;
  const double variance = described(slot, slot.place).cc;
  times = std::min(times, std::max(1., kMost / variance));
  if (slot.place == kNone) return setCovariance(slot.point, times * covariance(slot.point));
  const int p = row(slot.place), n = rows();
  P_.middleRows(p, 3).leftCols(n) *= std::sqrt(times);
  P_.middleCols(p, 3).topRows(n) *= std::sqrt(times);
}

void SharedErrorFilter::resetShared() {
  const ErrorProfile& e = options_.errors;
  values_.setZero();
  for (int i = 0; i < constants_; ++i) values_(i) = calibrated(i);
  before_ = values_.head(constants_);
  P_.setZero();
  const auto prior = [this](int index, double sigma) {
    if (index == kNone) return;
    P_(index, index) = sigma * sigma;
  };
  prior(latency_, e.latency_s);
  for (int axis = 0; axis < 3; ++axis) {
    if (bias_ != kNone) prior(bias_ + axis, e.gyroBiasSigma(axis));
    if (mount_ != kNone) prior(mount_ + axis, e.mountSigma(axis));
  }
  prior(focal_, e.focal);
  prior(scale_, e.scale);
  prior(slip_, e.slip.sigma);
  reckoned_ = e.slip;
  slipSum_ = slipTold_s_ = 0;
  prior(jitter_, e.jitter_s);
  nisSum_ = 2;
  nisWeight_ = 1;
  nisValues_ = rejected_ = 0;
  rejectedShare_ = 0;
  cost_ = 0;
}

// --- Slots

const SharedErrorFilter::Slot* SharedErrorFilter::find(int id) const {
  return detail::findById(slots_, size_, id);
}

SharedErrorFilter::Slot* SharedErrorFilter::findOrAdd(int id) {
  if (Slot* known = detail::findById(slots_, size_, id)) return known;
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
    const bool isState = std::abs(p.x) + std::abs(p.y) + std::abs(p.chi) < detail::kLargestState;
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
    if (holder && holder->unseen <= kLongestAbsence) continue;
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
         : isMount(index)  ? e.mountSigma(index - mount_)
                           : e.gyroBiasSigma(index - bias_);
}

double SharedErrorFilter::calibrated(int index) const {
  const ErrorProfile::Values& v = options_.errors.values;
  return index == latency_ ? v.latency_s
         : index == focal_ ? v.focal
         : index == scale_ ? v.scale
         : isMount(index)  ? v.mount_rad(index - mount_)
                           : v.gyroBias_rad_s(index - bias_);
}

SharedErrorFilter::Shared SharedErrorFilter::shared(int index, double prior) const {
  if (index == kNone) return {};
  const double expected = index < constants_ ? calibrated(index) : 0;
  return {values_(index), std::sqrt(std::max(P_(index, index), 0.)), prior, index, expected};
}

double SharedErrorFilter::correlation(const Shared& a, const Shared& b) const {
  if (a.index == kNone || b.index == kNone) return 0;
  const double scale = a.sigma * b.sigma;
  return scale > 0 ? P_(a.index, b.index) / scale : 0;
}

SharedErrorFilter::Shared SharedErrorFilter::latency() const {
  return shared(latency_, options_.errors.latency_s);
}

SharedErrorFilter::Shared SharedErrorFilter::gyroBias(int axis) const {
  return shared(bias_ == kNone ? kNone : bias_ + axis, options_.errors.gyroBiasSigma(axis));
}

SharedErrorFilter::Shared SharedErrorFilter::mount(int axis) const {
  return shared(mount_ == kNone ? kNone : mount_ + axis, options_.errors.mountSigma(axis));
}

SharedErrorFilter::Shared SharedErrorFilter::focal() const {
  return shared(focal_, options_.errors.focal);
}

SharedErrorFilter::Shared SharedErrorFilter::slip() const {
  return shared(slip_, options_.errors.slip.sigma);
}

}  // namespace depthservo
