#include "depthservo/depth/JointDepthFilter.h"

#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/findById.h"

namespace depthservo {
namespace {

using detail::FilterPoint;
using detail::Verdict;
using Phase = FilterPoint::Phase;

/// A common state is observed when its sigma is below this share of the prior's.
constexpr double kObserved = 0.25;

/// kappa stays within this factor.
constexpr double kFocalRange = 3;

/// The time offset stays within this many sigma of its prior.
constexpr double kOffsetRange = 6;

/// Images without a joint point before another may take its place.
constexpr int kPatience = 15;

/// A point joins instead of another when its relative sigma is less than this share of its.
constexpr double kBetter = 0.5;

}  // namespace

JointDepthFilter::JointDepthFilter(std::size_t capacity, const Options& options,
                                   const DepthPrior& prior, const DepthRange& range)
    : options_(options), prior_(prior), range_(range), slots_(capacity) {
  if (options_.estimateTimeOffset) timeOffset_ = common_++;
  if (options_.estimateGyroBias) {
    bias_ = common_;
    common_ += 3;
  }
  if (options_.estimateFocal) focal_ = common_++;
  reset();
}

std::unique_ptr<PointSetEstimator> JointDepthFilter::clone() const {
  return std::make_unique<JointDepthFilter>(*this);
}

void JointDepthFilter::reset() {
  size_ = ignored_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  places_ = 0;
  joint_.fill(kNone);
  values_.fill(0);
  for (Row& r : P_) r.fill(0);
  scale_.fill(0);
  focalSensitivity_.fill(0);
  const auto prior = [this](int index, double value, double sigma) {
    values_[index] = value;
    P_[index][index] = sigma * sigma;
  };
  if (timeOffset_ != kNone) prior(timeOffset_, 0, options_.timeOffsetSigma_s);
  for (int i = 0; bias_ != kNone && i < 3; ++i) prior(bias_ + i, 0, options_.gyroBiasSigma_rad_s);
  if (focal_ != kNone) prior(focal_, 1, options_.focalSigma);
  for (auto& ofStretch : change_) ofStretch.fill(-1);
  step_ = {};
  dt_ = 0;
}

// --- Slots

const JointDepthFilter::Slot* JointDepthFilter::find(int id) const {
  return detail::findById(slots_, size_, id);
}

JointDepthFilter::Slot* JointDepthFilter::findOrAdd(int id) {
  if (Slot* known = detail::findById(slots_, size_, id)) return known;
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot = {};
  slot.id = id;
  slot.prior = prior_;
  return &slot;
}

bool JointDepthFilter::setPrior(int id, const DepthPrior& prior) {
  Slot* slot = findOrAdd(id);
  if (!slot) return false;
  leave(*slot);
  slot->prior = prior;
  slot->isStarted = false;
  return true;
}

bool JointDepthFilter::isJoint(int id) const {
  const Slot* slot = find(id);
  return slot && slot->place != kNone;
}

bool JointDepthFilter::retire(int id) {
  const Slot* known = find(id);
  if (!known) return false;
  const auto index = static_cast<std::size_t>(known - slots_.data());
  leave(slots_[index]);
  slots_[index] = slots_[--size_];
  if (index < size_ && slots_[index].place != kNone) {
    joint_[slots_[index].place] = static_cast<int>(index);
  }
  return true;
}

// --- Correction

void JointDepthFilter::correct(const std::vector<PointObservation>& observations) {
  for (std::size_t i = 0; i < size_; ++i) ++slots_[i].unseen;
  for (const PointObservation& observation : observations) {
    Slot* slot = findOrAdd(observation.id);
    if (!slot) {
      ++ignored_;
      continue;
    }
    const PointMeasurement& measured = observation.measurement;
    if (!slot->isStarted) {
      if (!measured.isUsable()) continue;
      start(*slot, measured, slot->prior);
      slot->isStarted = true;
    } else if (slot->place != kNone) {
      correctJoint(*slot, measured);
    } else {
      const double scale = 1 / kappa();
      detail::correctPoint(slot->point,
                           {measured.x * scale, measured.y * scale, measured.sigma * scale},
                           options_.filter, range_);
    }
    slot->unseen = 0;
  }
  elect();
}

void JointDepthFilter::start(Slot& slot, const PointMeasurement& measurement,
                             const DepthPrior& prior) {
  const double scale = 1 / kappa();
  detail::resetPoint(slot.point,
                     {measurement.x * scale, measurement.y * scale, measurement.sigma * scale},
                     prior.sanitised(range_));
  if (slot.place != kNone) takePlace(slot);
}

/// Puts the covariance of the point alone at its place, and its state in measured units.
void JointDepthFilter::takePlace(Slot& slot) {
  FilterPoint& point = slot.point;
  const double k = kappa();
  const int p = row(slot.place);
  clearPlace(slot.place);
  const double block[3][3] = {{point.xx, point.xy, point.xc},
                              {point.xy, point.yy, point.yc},
                              {point.xc, point.yc, point.cc}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) P_[p + i][p + j] = k * k * block[i][j];
    scale_[p + i] = k * point.scale[i];
    focalSensitivity_[p + i] = k * point.focal[i];
  }
  point.x *= k;
  point.y *= k;
  point.chi *= k;
}

void JointDepthFilter::addToState(const Row& k, double nu) {
  for (int i = 0; i < common_; ++i) values_[i] += k[i] * nu;
  if (focal_ != kNone) values_[focal_] = std::clamp(values_[focal_], 1 / kFocalRange, kFocalRange);
  for (int place = 0; place < places_; ++place) {
    Slot* slot = slotAt(place);
    if (!slot) continue;
    const int p = row(place);
    slot->point.x += k[p] * nu;
    slot->point.y += k[p + 1] * nu;
    slot->point.chi += k[p + 2] * nu;
  }
}

void JointDepthFilter::correctJoint(Slot& slot, const PointMeasurement& measurement) {
  FilterPoint& point = slot.point;
  if (!measurement.isUsable()) {
    point.phase = Phase::rejected;
    return;
  }
  const InverseDepthFilterOptions& o = options_.filter;
  const int p = row(slot.place), n = rows(), width = detail::padded(n);
  const double r = detail::measurementVariance(measurement.sigma);
  const Row ux = P_[p], uy = P_[p + 1];
  const double Sxx = ux[p], Sxy = ux[p + 1], Syy = uy[p + 1];
  const double nu_x = measurement.x - point.x, nu_y = measurement.y - point.y;

  // Change of the innovation by the considered parameters.
  const double bySx = -scale_[p], bySy = -scale_[p + 1];
  const double byFx = point.x - focalSensitivity_[p], byFy = point.y - focalSensitivity_[p + 1];
  const double s2 = o.odometryScaleSigma * o.odometryScaleSigma;
  const double f2 = isConsideringFocal() ? o.focalSigma * o.focalSigma : 0;
  double a = Sxx + r + s2 * bySx * bySx + f2 * byFx * byFx;
  double b = Sxy + s2 * bySx * bySy + f2 * byFx * byFy;
  double c = Syy + r + s2 * bySy * bySy + f2 * byFy * byFy;
  const double nis = detail::nisOf(a, b, c, nu_x, nu_y);
  switch (detail::judge(point, nis, o)) {
    case Verdict::restart:
      start(slot, measurement, {1 / range_.clampChi(point.chi / kappa())});
      return;
    case Verdict::reject:
      point.phase = Phase::rejected;
      return;
    case Verdict::use:
      break;
  }
  const double weighted = detail::weighted(r, nis, o);
  a = Sxx + weighted;
  b = Sxy;
  c = Syy + weighted;
  const double det = a * c - b * b;
  Row kx, ky;
  for (int j = 0; j < width; ++j) {
    kx[j] = (c * ux[j] - b * uy[j]) / det;
    ky[j] = (a * uy[j] - b * ux[j]) / det;
  }
  addToState(kx, nu_x);
  addToState(ky, nu_y);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_[i][i];
    for (int j = 0; j < width; ++j) P_[i][j] -= kx[i] * ux[j] + ky[i] * uy[j];
    P_[i][i] = std::max(P_[i][i], least);
  }
  if (timeOffset_ != kNone) {
    const double limit = kOffsetRange * options_.timeOffsetSigma_s;
    values_[timeOffset_] = std::clamp(values_[timeOffset_], -limit, limit);
  }
  for (int j = 0; s2 > 0 && j < n; ++j) scale_[j] += kx[j] * bySx + ky[j] * bySy;
  for (int j = 0; f2 > 0 && j < n; ++j) focalSensitivity_[j] += kx[j] * byFx + ky[j] * byFy;
  point.r = r;
  point.phase = Phase::measured;
}

void JointDepthFilter::correctDepth(int id, const DepthPrior& measured) {
  Slot* known = detail::findById(slots_, size_, id);
  if (!known || !known->isStarted || !measured.isUsable()) return;
  Slot& slot = *known;
  if (slot.place == kNone) {
    detail::correctPointDepth(slot.point, measured, range_);
    return;
  }
  const int c = row(slot.place) + 2, n = rows();
  const double chi = range_.clampChi(1 / measured.Z);
  const double variance = detail::depthVariance(chi, measured.sigma_chi);
  const double byChi = 1 / kappa(), byKappa = -slot.point.chi * byChi * byChi;
  const auto seen = [&](const Row& e) {
    return byChi * e[c] + (focal_ == kNone ? 0 : byKappa * e[focal_]);
  };
  Row u = {}, k = {};
  for (int j = 0; j < n; ++j) u[j] = seen(P_[j]);
  const double sum = seen(u) + variance;
  if (!(sum > 0)) return;
  for (int j = 0; j < n; ++j) k[j] = u[j] / sum;
  addToState(k, chi - slot.point.chi * byChi);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_[i][i];
    for (int j = 0; j < n; ++j) P_[i][j] -= k[i] * u[j];
    P_[i][i] = std::max(P_[i][i], least);
  }
  const double byScale = -seen(scale_), byFocal = -seen(focalSensitivity_);
  for (int j = 0; j < n; ++j) {
    scale_[j] += k[j] * byScale;
    focalSensitivity_[j] += k[j] * byFocal;
  }
}

// --- Which points are joint

void JointDepthFilter::clearPlace(int place) {
  const int p = row(place);
  for (int i = p; i < p + 3; ++i) {
    P_[i].fill(0);
    for (Row& r : P_) r[i] = 0;
    scale_[i] = focalSensitivity_[i] = 0;
  }
}

void JointDepthFilter::join(Slot& slot) {
  const auto place =
      static_cast<int>(std::find(joint_.begin(), joint_.end(), kNone) - joint_.begin());
  slot.place = place;
  joint_[place] = static_cast<int>(&slot - slots_.data());
  places_ = std::max(places_, place + 1);
  takePlace(slot);
}

void JointDepthFilter::leave(Slot& slot) {
  if (slot.place == kNone) return;
  slot.point = described(slot);
  joint_[slot.place] = kNone;
  clearPlace(slot.place);
  slot.place = kNone;
  while (places_ > 0 && joint_[places_ - 1] == kNone) --places_;
}

void JointDepthFilter::elect() {
  const auto relativeSigma = [this](const Slot& slot) {
    const double cc =
        slot.place == kNone ? slot.point.cc : P_[row(slot.place) + 2][row(slot.place) + 2];
    return std::sqrt(cc) / std::max(slot.point.chi, 1 / range_.Z_max);
  };
  const auto isCandidate = [](const Slot& slot) {
    return slot.isStarted && slot.place == kNone && slot.point.phase == Phase::measured;
  };
  // Squared distance in the image to the nearest joint point: points far apart tell more.
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
  const auto isFull = [this] {
    return std::find(joint_.begin(), joint_.end(), kNone) == joint_.end();
  };
  while (!isFull()) {
    Slot* best = nullptr;
    double bestSpread = -1;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!isCandidate(slots_[i])) continue;
      const double s = spread(slots_[i]);
      if (s > bestSpread) {
        best = &slots_[i];
        bestSpread = s;
      }
    }
    if (!best) return;
    join(*best);
  }
  Slot* best = nullptr;
  for (std::size_t i = 0; i < size_; ++i) {
    if (!isCandidate(slots_[i])) continue;
    if (!best || relativeSigma(slots_[i]) < relativeSigma(*best)) best = &slots_[i];
  }
  if (!best) return;
  Slot* worst = slotAt(0);
  const auto badness = [&](const Slot& slot) {
    return slot.unseen > kPatience ? std::numeric_limits<double>::infinity() : relativeSigma(slot);
  };
  for (int place = 1; place < places_; ++place) {
    if (badness(*slotAt(place)) > badness(*worst)) worst = slotAt(place);
  }
  if (relativeSigma(*best) < kBetter * badness(*worst)) {
    leave(*worst);
    join(*best);
  }
}

// --- Reports

FilterPoint JointDepthFilter::described(const Slot& slot) const {
  FilterPoint point = slot.point;
  if (slot.place == kNone) return point;
  const int p = row(slot.place);
  const double scale = 1 / kappa(), scale2 = scale * scale;
  point.x *= scale;
  point.y *= scale;
  point.chi *= scale;
  point.xx = scale2 * P_[p][p];
  point.xy = scale2 * P_[p][p + 1];
  point.xc = scale2 * P_[p][p + 2];
  point.yy = scale2 * P_[p + 1][p + 1];
  point.yc = scale2 * P_[p + 1][p + 2];
  point.cc = scale2 * P_[p + 2][p + 2];
  if (focal_ != kNone) {  // chi = state / kappa
    point.cc += point.chi * scale *
                (point.chi * scale * P_[focal_][focal_] - 2 * scale * P_[p + 2][focal_]);
    point.cc = std::max(point.cc, 0.);
  }
  for (int i = 0; i < 3; ++i) {
    point.scale[i] = scale * scale_[p + i];
    point.focal[i] = scale * focalSensitivity_[p + i];
  }
  return point;
}

DepthEstimate JointDepthFilter::estimate(int id) const {
  const Slot* slot = find(id);
  if (!slot || !slot->isStarted) {
    const DepthPrior prior = (slot ? slot->prior : prior_).sanitised(range_);
    DepthEstimate unset;
    unset.chi = 1 / prior.Z;
    unset.sigma_chi = prior.sigma_chi;
    return unset;
  }
  InverseDepthFilterOptions options = options_.filter;
  if (focal_ != kNone) options.focalSigma = 0;
  DepthEstimate e = detail::describePoint(described(*slot), step_, dt_, options, range_);
  e.x *= kappa();
  e.y *= kappa();
  e.sigma_xy *= kappa();
  return e;
}

JointDepthFilter::Common JointDepthFilter::common(int index, double prior) const {
  if (index == kNone) return {};
  const double sigma = std::sqrt(P_[index][index]);
  return {values_[index], sigma, true, sigma < kObserved * prior};
}

JointDepthFilter::Common JointDepthFilter::timeOffset() const {
  return common(timeOffset_, options_.timeOffsetSigma_s);
}

JointDepthFilter::Common JointDepthFilter::gyroBias(int axis) const {
  return common(bias_ == kNone ? kNone : bias_ + axis, options_.gyroBiasSigma_rad_s);
}

JointDepthFilter::Common JointDepthFilter::focal() const {
  Common kappa = common(focal_, options_.focalSigma);
  if (!kappa.isEstimated) kappa.value = 1;
  return kappa;
}

}  // namespace depthservo
