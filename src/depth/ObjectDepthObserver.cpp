#include "depthservo/depth/ObjectDepthObserver.h"

#include <algorithm>
#include <cmath>

#include "depth/findById.h"

namespace depthservo {

using namespace detail;

ObjectDepthObserver::ObjectDepthObserver(std::size_t capacity, const Options& options,
                                         const DepthPrior& prior, const DepthRange& range)
    : options_(options), prior_(prior.sanitised(range)), range_(range), points_(capacity) {
  reset();
}

std::unique_ptr<PointSetEstimator> ObjectDepthObserver::clone() const {
  return std::make_unique<ObjectDepthObserver>(*this);
}

void ObjectDepthObserver::reset() {
  size_ = ignored_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  isStarted_ = false;
  isMotionKnown_ = true;
  chi_ = 1 / prior_.Z;
  variance_ = {0, 0, square(prior_.sigma_chi)};
  priorChiSum_ = priorSigmaSum_ = 0;
  priors_ = 0;
}

const ObjectDepthObserver::Point* ObjectDepthObserver::find(int id) const {
  return detail::findById(points_, size_, id);
}

ObjectDepthObserver::Point* ObjectDepthObserver::findOrAdd(int id) {
  if (Point* known = detail::findById(points_, size_, id)) return known;
  if (size_ == points_.size()) return nullptr;
  Point& point = points_[size_++];
  point = {};
  point.id = id;
  return &point;
}

bool ObjectDepthObserver::setPrior(int id, const DepthPrior& prior) {
  Point* point = findOrAdd(id);
  if (!point) return false;
  const bool isNew = point->phase == Phase::unset;
  if (isNew && isStarted_) return true;  // the object's depth is known better than a guess
  const DepthPrior usable = prior.sanitised(range_);
  priorChiSum_ += 1 / usable.Z;
  priorSigmaSum_ += usable.sigma_chi;
  ++priors_;
  point->phase = Phase::unset;
  isStarted_ = false;
  return true;
}

void ObjectDepthObserver::startObject(double measurementVariance) {
  if (priors_ > 0) {
    chi_ = range_.clampChi(priorChiSum_ / priors_);
    variance_.cc = square(priorSigmaSum_ / priors_);
  }
  priorChiSum_ = priorSigmaSum_ = 0;
  priors_ = 0;
  variance_ = {measurementVariance, 0, variance_.cc};
  g_ = rho_ = 1;
  elapsed_s_ = 0;
  window_ = {};
  W_ = 0;
  isStarted_ = true;
  for (std::size_t i = 0; i < size_; ++i) points_[i].c.setZero();
}

void ObjectDepthObserver::forgetPoints() {
  for (std::size_t i = 0; i < size_; ++i) points_[i].phase = Phase::unset;
  variance_ = {0, 0, square(DepthPrior::kWideSigma_chi)};
  isStarted_ = false;
}

Coverage ObjectDepthObserver::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {  // the first image: nothing to move yet
    if (!std::isfinite(time_s)) return Coverage::reversed;
    time_s_ = time_s;
    return Coverage::complete;
  }
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) return coverage;
  if (hasMotion(coverage)) {
    predict(motion);
  } else {
    forgetPoints();
  }
  time_s_ = time_s;
  return coverage;
}

void ObjectDepthObserver::predict(const Motion& motion) {
  if (!motion.isUsable()) return;
  isMotionKnown_ = !motion.unknown.exists();
  const OdometryNoise::Step noise = options_.odometry.over(motion);
  double chiSum = 0, gSum = 0, W2Sum = 0;
  int followed = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    Point& p = points_[i];
    p.isUsed = false;
    if (!p.isFollowed()) continue;
    const PointState before{p.s.x(), p.s.y(), chi_};
    const Flow next = flow(motion, before);
    const Eigen::Vector3d byChi =
        flowDerivative(motion, before, next.point, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d carried =
        flowDerivative(motion, before, next.point, {p.c.x(), p.c.y(), 1});
    const double W = byChi.head<2>().norm() / motion.dt;
    if (!next.ahead || !(carried.lpNorm<1>() + W < kBeyondSense)) {
      p.phase = Phase::gone;
      continue;
    }
    p.s << next.point.x, next.point.y;
    p.c = carried.head<2>();
    p.W = W;
    p.elapsed_s += motion.dt;
    p.odometryVariance += noise.variance_t * chi_ * chi_ +
                          noise.variance_theta * (1 + before.x * before.x + before.y * before.y);
    chiSum += next.point.chi;
    gSum += carried.z();
    W2Sum += W * W;
    ++followed;
  }
  if (followed == 0) return;
  const double g = gSum / followed;
  const bool isSane = std::abs(g) > 1 / kBeyondSense && std::abs(g_ * g) < kBeyondSense;
  if (!isSane) return forgetPoints();
  chi_ = range_.clampChi(chiSum / followed);
  g_ *= g;
  elapsed_s_ += motion.dt;
  rho_ = std::min(rho_, noise.rho);
  W_ = std::sqrt(W2Sum / followed);
  const double W2 = noise.rho * W2Sum / followed;
  window_.add(W2, options_.gains.wn2At(W2) / options_.gains.k, motion.dt, options_.window_s);
  for (std::size_t i = 0; i < size_; ++i) {
    Point& p = points_[i];
    if (!p.isFollowed()) continue;
    p.c /= g;
    if (!(p.c.lpNorm<1>() < kBeyondSense)) {
      p.phase = Phase::gone;
      continue;
    }
    const bool isVague = positionVariance(p) > square(options_.lost_sigma);
    p.phase = isVague ? Phase::vague : Phase::coasting;
  }
  if (motion.unknown.exists()) letDrift(motion.unknown);
}

/// What is not known of the motion teaches nothing: no parallax is left of it.
void ObjectDepthObserver::letDrift(const UnknownPart& unknown) {
  const double sigma_chi = std::abs(g_) * std::sqrt(std::max(0.0, variance_.cc));
  double widest_chi = sigma_chi;
  for (std::size_t i = 0; i < size_; ++i) {
    Point& p = points_[i];
    if (!p.isFollowed()) continue;
    const PointSigmas sigmas{std::sqrt(std::max(0.0, positionVariance(p))), sigma_chi};
    const PointSigmas wide = widened(sigmas, {p.s.x(), p.s.y(), chi_}, unknown);
    widest_chi = std::max(widest_chi, wide.chi);
    p.odometryVariance = square(wide.xy);
    p.c.setZero();
    p.isAdrift = true;
    if (wide.xy > options_.lost_sigma) p.phase = Phase::vague;
  }
  variance_ = {0, 0, square(widest_chi)};
  g_ = rho_ = 1;
  elapsed_s_ = 0;
}

double ObjectDepthObserver::positionVariance(const Point& point) const {
  return variance_.ll + point.c.squaredNorm() * g_ * g_ * variance_.cc + point.odometryVariance;
}

void ObjectDepthObserver::start(Point& point, const PointMeasurement& measurement) {
  const int id = point.id;
  point = {};
  point.id = id;
  point.phase = Phase::measured;
  point.s << measurement.x, measurement.y;
  point.isUsed = true;
}

void ObjectDepthObserver::take(Point& point, const PointMeasurement& measurement) {
  if (point.isAdrift) return start(point, measurement);
  const double variance = positionVariance(point) + square(measurement.sigma);
  point.nu = Eigen::Vector2d(measurement.x, measurement.y) - point.s;
  if (!(point.nu.squaredNorm() <= squaredGate(options_.gate, options_.gate_sigma, variance))) {
    point.phase = Phase::rejected;
    if (++point.rejections > options_.rejectionsInARow) start(point, measurement);
    return;
  }
  point.rejections = 0;
  point.phase = Phase::measured;
  point.isUsed = true;
}

void ObjectDepthObserver::correct(const std::vector<PointObservation>& observations) {
  double varianceSum = 0;
  int taken = 0;
  for (const auto& [id, measurement] : observations) {
    Point* point = findOrAdd(id);
    if (!point) {
      ++ignored_;
      continue;
    }
    if (!measurement.isUsable()) {
      if (point->isFollowed()) point->phase = Phase::rejected;
      continue;
    }
    if (!isStarted_) startObject(square(measurement.sigma));
    if (!point->isFollowed()) {
      start(*point, measurement);
    } else if (!point->isUsed && point->elapsed_s > 0) {
      take(*point, measurement);
      if (!point->isUsed || point->elapsed_s == 0) continue;
      varianceSum += square(measurement.sigma);
      ++taken;
    }
  }
  if (taken > 0) apply(varianceSum / taken);
}

void ObjectDepthObserver::apply(double variance) {
  double cc = 0, cnu = 0, W2Sum = 0, odometry = 0;
  int n = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    const Point& p = points_[i];
    if (!p.isUsed || p.elapsed_s == 0) continue;
    cc += p.c.squaredNorm();
    cnu += p.c.dot(p.nu);
    W2Sum += p.c.squaredNorm() / square(p.elapsed_s);
    odometry += p.odometryVariance;
    ++n;
  }
  const double C = std::sqrt(cc), perLine = 1 / C;
  gains_.match(options_.gains.k, options_.gains.wn2At(W2Sum / n), elapsed_s_);
  const double chiPerLine = C > kNoExcitation * elapsed_s_ ? rho_ * gains_.chi * perLine : 0;
  const double before = chi_;
  if (chiPerLine > 0) chi_ = range_.clampChi(chi_ + chiPerLine * cnu * perLine);

  for (std::size_t i = 0; i < size_; ++i) {
    Point& p = points_[i];
    if (!p.isFollowed() || p.elapsed_s == 0) continue;
    if (p.isUsed) {
      p.s += gains_.point * p.nu;
      p.c.setZero();
      p.elapsed_s = p.odometryVariance = 0;
    } else {
      p.s += p.c * (chi_ - before);  // where the corrected depth puts a hidden point
    }
  }
  variance_ =
      variance_.predicted(g_ * C, g_, odometry / n).corrected(gains_.point, chiPerLine, variance);
  if (!(variance_.ll + variance_.cc < kBeyondSense)) {
    variance_ = {0, 0, square(DepthPrior::kWideSigma_chi)};
  }
  g_ = rho_ = 1;
  elapsed_s_ = 0;
}

void ObjectDepthObserver::correctDepth(int id, const DepthPrior& measured) {
  const Point* point = find(id);
  if (!point || !point->isFollowed() || !measured.isUsable()) return;
  const double R = square(measured.sigma_chi), cc = g_ * g_ * variance_.cc;
  const double gain = R > 0 ? cc / (cc + R) : 1;
  chi_ = range_.clampChi(chi_ + gain * (1 / measured.Z - chi_));
  variance_.cc *= 1 - gain;
  variance_.lc *= 1 - gain;
}

DepthEstimate ObjectDepthObserver::estimate(int id) const {
  DepthEstimate e;
  e.chi = !isStarted_ && priors_ > 0 ? range_.clampChi(priorChiSum_ / priors_) : chi_;
  e.sigma_chi = std::min(std::abs(g_) * std::sqrt(std::max(0.0, variance_.cc)),
                         DepthPrior::kLargestSigma_chi);
  const Point* point = find(id);
  if (!point || point->phase == Phase::unset) return e;
  e.x = point->s.x();
  e.y = point->s.y();
  e.sigma_xy =
      std::min(std::sqrt(std::max(0.0, positionVariance(*point))), PointMeasurement::kLargestSigma);
  e.excitation = point->W;
  const bool isExcited = W_ > kNoExcitation && window_.isExcited();
  e.status = statusOf(point->phase, isExcited, range_.isFound(e.chi, e.sigma_chi));
  if (!isMotionKnown_) e.status = whileMotionIsUnknown(e.status);
  return e;
}

}  // namespace depthservo
