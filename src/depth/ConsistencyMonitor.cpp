#include "depthservo/depth/ConsistencyMonitor.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "depth/FilterPointSteps.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

using detail::FilterPoint;
using detail::Verdict;
using Phase = FilterPoint::Phase;
using Cause = ConsistencyMonitor::Cause;

enum Hypothesis { kLatency = 0, kGyroBias = 1, kFocal = 4, kTarget = 5 };

/// Which hypotheses a cause has, in the order of kModelled.
constexpr struct {
  int first, count;
} kHypothesesOf[] = {{kLatency, 1}, {kGyroBias, 3}, {kFocal, 1}, {kTarget, 3}};
constexpr auto& kModelled = ConsistencyMonitor::kModelled;
static_assert(std::size(kHypothesesOf) == kModelled.size());

/// Half-width of the band of the mean NIS, in sigma of the mean.
constexpr double kBand = 5;

/// Rejections that good measurements may have: this many times the expected, and some.
constexpr double kRejectionFactor = 5, kRejectionSlack = 5;
constexpr double kExpectedRejections = 1e-3;

/// Images that must have been seen before anything is said.
constexpr int kFewest = 30;

/// How long a cause must be the likeliest before it is named [s].
constexpr double kAgreed_s = 0.5;

/// The same of the motion as a whole: other causes take that long to gather evidence [s].
constexpr double kMotionAgreed_s = 2;

/// A latency below this share of the image period is not told from odometry noise, which has the
/// same effect as half a period when it is measured (averaging two noisy twists helps).
constexpr double kLeastLatency = 0.6;

/// A cause must lower the sum of NIS by this: what the declared noise covers anyhow is no fault.
constexpr double kLeastExplained = 25;

/// No camera is calibrated worse than this; motion that hardly shows the focal length, straight
/// ahead with noisy odometry, fits such values. Nor is a gyro that bad [rad/s], an image that late
/// [s]: beyond, the motion is another one.
constexpr double kLargestFocal = 0.4, kLargestGyroBias = 0.2, kLargestLatency = 0.3;

/// Mean NIS of the measurements that were not rejected, below which the rejected ones are outliers
/// rather than signs of a wrong model.
constexpr double kOthersAgree = 2.6;

/// Causes that explain at least this share of what the best one does cannot be told apart.
constexpr double kRivals = 0.8;

/// From this share of rejected measurements on something is wrong that a small error is not; and a
/// cause that leaves more than this share of it unexplained is not the cause.
constexpr double kManyRejected = 0.15;
constexpr double kUnexplained = 0.5;

/// The same where hardly a measurement is accepted: then nearly all must be explained.
constexpr double kUnexplainedOfAll = 0.1;

/// Measurements without which there is no verdict.
constexpr int kFewestValues = ConsistencyMonitor::kFewestValues;

/// A target that moves slower than this is not told from the odometry's error [m/s].
constexpr double kLeastSpeed = 0.001;

/// NIS beyond which a point starts anew: it is another point.
constexpr double kLargestNis = 1e6;

/// Evidence from which on a cause that explains enough counts against depths, named or not.
constexpr double kSuspicion = 3.5;

/// Keeps directions without any information out of a fit.
constexpr double kRegularisation = 1e-6;

/// Weight of an innovation in the score of an image: far ones count for less and less.
double scoreWeight(double nis) {
  constexpr double kFar = 6.25;
  return nis > kFar ? kFar / nis : 1;
}

}  // namespace

struct ConsistencyMonitor::Slot {
  int id = 0;
  bool isStarted = false;
  FilterPoint point;
  Eigen::Matrix<double, 3, kHypotheses> e;  // d(true - estimated state) by each hypothesis
};

ConsistencyMonitor::ConsistencyMonitor(std::size_t capacity, const Options& options,
                                       const DepthPrior& prior, const DepthRange& range)
    : options_(options),
      prior_(prior),
      range_(range),
      slots_(capacity),
      images_(static_cast<std::size_t>(std::max(1, options.window))) {
  reset();
}

ConsistencyMonitor::ConsistencyMonitor(const ConsistencyMonitor&) = default;
ConsistencyMonitor::~ConsistencyMonitor() = default;

void ConsistencyMonitor::reset() {
  size_ = next_ = 0;
  std::fill(images_.begin(), images_.end(), Image{});
  sum_.setZero();
  square_.setZero();
  information_.setZero();
  measured_ = rejected_ = far_ = excess_ = above_s_ = below_s_ = held_s_ = 0;
  all_ = {};
  latest_ = {};
  sizes_.setZero();
  wasNamed_ = {};
  startRcamera_.setIdentity();
  twistCount_ = 0;
  dt_ = sinceCorrection_s_ = 0;
}

ConsistencyMonitor::Slot* ConsistencyMonitor::findOrAdd(int id) {
  for (std::size_t i = 0; i < size_; ++i) {
    if (slots_[i].id == id) return &slots_[i];
  }
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot.id = id;
  slot.isStarted = false;
  return &slot;
}

void ConsistencyMonitor::retire(int id) {
  for (std::size_t i = 0; i < size_; ++i) {
    if (slots_[i].id != id) continue;
    slots_[i] = slots_[--size_];
    return;
  }
}

void ConsistencyMonitor::predict(const Motion& motion) {
  if (!motion.isUsable()) return;
  step_ = options_.filter.odometry.over(motion);
  dt_ = motion.dt;
  sinceCorrection_s_ += motion.dt;
  std::copy_backward(twists_.begin(), twists_.end() - 1, twists_.end());
  const Twist twist = motion.twist();
  twists_[0] = twist.vector();
  const double n = 1 / (dt_ * dt_), band = options_.filter.odometry.deadBand;
  isMoving_ = options_.filter.odometry.mode == OdometryMode::commanded || step_.rho > 0 ||
              twist.angular.squaredNorm() > band * band * step_.variance_theta * n;
  twistCount_ = std::min(twistCount_ + 1, static_cast<int>(twists_.size()));
  startRcamera_ = startRcamera_ * motion.R.transpose();
  for (std::size_t i = 0; i < size_; ++i) predictSlot(slots_[i], motion);
}

void ConsistencyMonitor::predictSlot(Slot& slot, const Motion& motion) {
  FilterPoint& p = slot.point;
  if (!slot.isStarted || p.phase == Phase::behind) return;
  const PointState before{p.x, p.y, p.chi};
  detail::predictPoint(p, detail::FilterStep(motion, step_), options_.filter);
  if (p.phase == Phase::behind) return;
  const PointState after{p.x, p.y, p.chi};
  const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
  slot.e = flowJacobian(motion, before, after) * slot.e;
  const Eigen::Matrix<double, 3, 6> Ldt = motion.dt * L;
  if (twistCount_ == 4) {
    const Vector6d acceleration =
        (twists_[0] + twists_[1] - twists_[2] - twists_[3]) / (4 * motion.dt);
    slot.e.col(kLatency) -= Ldt * acceleration;
  }
  slot.e.middleCols<3>(kGyroBias) -= Ldt.rightCols<3>();
  // A target that moves with V is a camera that moves with -V.
  slot.e.middleCols<3>(kTarget) -= Ldt.leftCols<3>() * startRcamera_.transpose();
}

/// Unlike the filter it never skips or restarts while the numbers hold: whatever the gain, the
/// sensitivities say what the innovation should be, as long as every step is known.
void ConsistencyMonitor::correctSlot(Slot& slot, const PointMeasurement& measurement) {
  FilterPoint& p = slot.point;
  const InverseDepthFilterOptions& options = options_.filter;
  const double r = detail::measurementVariance(measurement.sigma);
  detail::FilterState<double> s = detail::stateOf(p);
  detail::FilterInnovation<double> nu{};
  detail::innovate(s, measurement.x, measurement.y, r, nu);
  if (p.phase == Phase::behind || !(nu.det > 0 && nu.nis >= 0 && nu.nis < kLargestNis)) {
    countRejected(kCappedNis);
    excess_ += scoreWeight(kCappedNis) * kCappedNis - 2;  // and no cause explains it
    startSlot(slot, measurement, {1 / range_.clampChi(p.chi)});
    return;
  }
  // Sensitivity of the innovation. At rest measured noise would pass for a cause.
  Eigen::Matrix<double, 2, kHypotheses> by = slot.e.topRows<2>();
  by.col(kFocal) += Eigen::Vector2d(p.x, p.y);
  if (isMoving_) {
    Eigen::Matrix2d inverse;
    inverse << (s.yy + r), -s.xy, -s.xy, (s.xx + r);
    inverse *= scoreWeight(nu.nis) / nu.det;
    const Eigen::Matrix<double, kHypotheses, 2> weighted = by.transpose() * inverse;
    score_ += weighted * Eigen::Vector2d(nu.x, nu.y);
    information_ += weighted * by;
    excess_ += scoreWeight(nu.nis) * nu.nis - 2;
  }
  const bool isNear = nu.nis <= options.gate;
  if (isNear) {
    current_.sum += nu.nis;
    ++current_.count;
    all_.sum += nu.nis;
    ++all_.count;
    rejected_ += p.rejections == 1;  // alone: an outlier; in a row: rather a wrong model
    p.rejections = 0;
  } else {
    countRejected(nu.nis);
    ++p.rejections;
  }
  detail::FilterGain<double> K{};
  detail::correctState(s, nu, detail::weighted(r, nu.nis, options), K);
  Eigen::Matrix<double, 3, 2> gain;
  gain << K.xx, K.xy, K.yx, K.yy, K.cx, K.cy;
  slot.e -= gain * by;
  detail::setState(p, s);
  p.r = r;
  p.phase = Phase::measured;
}

void ConsistencyMonitor::countRejected(double nis) {
  current_.far += nis;
  ++current_.farCount;
  ++far_;
  all_.far += std::min(nis, kCappedNis);
  ++all_.farCount;
}

void ConsistencyMonitor::startSlot(Slot& slot, const PointMeasurement& measurement,
                                   const DepthPrior& prior) {
  detail::resetPoint(slot.point, measurement, prior.sanitised(range_));
  slot.isStarted = true;
  slot.e.setZero();
  slot.e.col(kFocal) << -measurement.x, -measurement.y, 0;
}

void ConsistencyMonitor::correct(const std::vector<PointObservation>& observations) {
  const double keep = std::exp(-sinceCorrection_s_ / options_.memory_s);
  sum_ *= keep;
  square_ *= keep;
  information_ *= keep;
  measured_ *= keep;
  rejected_ *= keep;
  far_ *= keep;
  excess_ *= keep;
  current_ = {};
  score_.setZero();
  for (const PointObservation& observation : observations) {
    const PointMeasurement& measured = observation.measurement;
    Slot* slot = measured.isUsable() ? findOrAdd(observation.id) : nullptr;
    if (!slot) continue;
    if (!slot->isStarted) {
      startSlot(*slot, measured, prior_);
      continue;
    }
    ++measured_;
    correctSlot(*slot, measured);
  }
  sum_ += score_;
  square_ += score_ * score_.transpose();
  images_[next_++ % images_.size()] = current_;

  const Nis nis = windowedNis();
  above_s_ = nis.deviation > kBand ? above_s_ + sinceCorrection_s_ : 0;
  below_s_ = nis.deviation < -kBand ? below_s_ + sinceCorrection_s_ : 0;
  const Fits fits = this->fits();
  const Diagnosis now = judged(fits);
  held_s_ = now.cause == latest_.cause ? held_s_ + sinceCorrection_s_ : 0;
  latest_ = now;
  sinceCorrection_s_ = 0;
  noteSizes(fits);
}

/// Of the cause that is named or suspected now, and of those that last and were named.
void ConsistencyMonitor::noteSizes(const Fits& fits) {
  const Cause named = diagnosis().cause;
  const Cause suspected = likeliest(fits, kSuspicion).cause;
  for (std::size_t i = 0; i < kModelled.size(); ++i) {
    const Cause cause = kModelled[i];
    const auto [first, count] = kHypothesesOf[i];
    wasNamed_[i] = (wasNamed_[i] || cause == named) && cause != Cause::movingTarget;
    if (cause == named || (cause == suspected && !wasNamed_[i])) {
      sizes_.segment(first, count) = fits[i].theta.head(count);
    } else if (!wasNamed_[i]) {
      sizes_.segment(first, count).setZero();
    }
  }
}

double ConsistencyMonitor::chiBy(Cause cause, int id) const {
  const auto modelled = std::find(kModelled.begin(), kModelled.end(), cause);
  const auto end = slots_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto slot = std::find_if(slots_.begin(), end, [&](const Slot& s) { return s.id == id; });
  if (modelled == kModelled.end() || slot == end) return 0;
  const auto [first, count] = kHypothesesOf[modelled - kModelled.begin()];
  return slot->e.row(2).segment(first, count).dot(sizes_.segment(first, count));
}

/// The mean over all values of the window. Its sigma is that of independent values, or what the
/// scatter between images says when that is more: points share the odometry's error.
ConsistencyMonitor::Nis ConsistencyMonitor::windowedNis() const {
  Nis nis;
  double sum = 0;
  int images = 0;
  for (const Image& image : images_) {
    sum += image.sum;
    nis.values += image.count;
    images += image.count > 0 ? 1 : 0;
  }
  if (nis.values == 0) return nis;
  nis.mean = sum / nis.values;
  if (images < kFewest) return nis;
  double scatter = 0;
  for (const Image& image : images_) {
    const double deviation = image.sum - image.count * nis.mean;
    scatter += deviation * deviation;
  }
  const double n = nis.values;
  const double sigma = std::max(2 / std::sqrt(n), std::sqrt(scatter) / n);
  nis.deviation = (nis.mean - 2) / sigma;
  return nis;
}

ConsistencyMonitor::Image ConsistencyMonitor::windowed() const {
  Image all;
  for (const Image& image : images_) {
    all.sum += image.sum;
    all.count += image.count;
    all.far += image.far;
    all.farCount += image.farCount;
  }
  return all;
}

ConsistencyMonitor::Total ConsistencyMonitor::total() const {
  const int n = all_.count + all_.farCount;
  return {all_.count, all_.farCount, n > 0 ? (all_.sum + all_.far) / n : 2};
}

double ConsistencyMonitor::varianceFactor() const {
  const Image all = windowed();
  const Cause cause = diagnosis().cause;
  const bool isModel = cause != Cause::none && cause != Cause::outliers && cause != Cause::noise &&
                       cause != Cause::noData;
  if (all.farCount > 0 && (isModel || all.farCount > all.count)) {
    return std::max(1., (all.sum + all.far) / (2 * (all.count + all.farCount)));
  }
  return above_s_ >= options_.hold_s ? std::max(1., windowedNis().mean / 2) : 1;
}

/// Least squares for one cause alone, theta = information^-1 sum.
ConsistencyMonitor::Fit ConsistencyMonitor::fitted(int first, int count) const {
  Fit fit;
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity(), C = Eigen::Matrix3d::Zero();
  for (int i = 0; i < count; ++i) {
    b[i] = sum_[first + i];
    for (int j = 0; j < count; ++j) {
      A(i, j) = information_(first + i, first + j);
      C(i, j) = square_(first + i, first + j);
    }
  }
  for (int i = 0; i < count; ++i) A(i, i) *= 1 + kRegularisation;
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (!(ldlt.vectorD().minCoeff() > 0)) return fit;
  const Eigen::Vector3d theta = ldlt.solve(b);
  const double scatter = theta.dot(C * theta);
  if (!theta.allFinite() || !(scatter > 0)) return fit;
  fit.explained = theta.dot(b);
  fit.evidence = fit.explained / std::sqrt(scatter);
  fit.theta = theta;
  fit.size = count == 1 ? theta[0] : theta.norm();
  return fit;
}

ConsistencyMonitor::Fits ConsistencyMonitor::fits() const {
  Fits fits;
  std::transform(std::begin(kHypothesesOf), std::end(kHypothesesOf), fits.begin(),
                 [&](const auto& h) { return fitted(h.first, h.count); });
  return fits;
}

ConsistencyMonitor::Diagnosis ConsistencyMonitor::judged(const Fits& fits) const {
  Diagnosis d;
  const Nis nis = windowedNis();
  d.meanNis = nis.mean;
  d.values = nis.values;
  d.rejected = windowed().farCount;
  if (next_ < static_cast<std::size_t>(kFewest)) return d;
  if (d.values + d.rejected < kFewestValues) {
    d.cause = Cause::noData;
    d.size = d.values + d.rejected;
    return d;
  }
  const double explained = judgeModel(fits, d);
  const bool manyRejected = far_ > kManyRejected * measured_;
  const bool areOutliers = nis.mean < kOthersAgree && rejected_ > kUnexplained * far_;
  const double mayRemain = d.values < kFewestValues ? kUnexplainedOfAll : kUnexplained;
  if (manyRejected && !areOutliers && explained < (1 - mayRemain) * excess_) {
    d.cause = Cause::motion;
    d.rival = Cause::none;
    d.size = far_ / measured_;
    d.evidence = std::sqrt(std::max(0., excess_ - explained));
    return d;
  }
  if (d.cause == Cause::none) judgeNoise(d);
  return d;
}

/// Of the causes with this much evidence the one that explains most, and the next one.
ConsistencyMonitor::Likeliest ConsistencyMonitor::likeliest(const Fits& fits,
                                                            double evidence) const {
  const bool isNoisy = step_.variance_t > 0 || step_.variance_theta > 0;
  Likeliest best;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const Cause cause = kModelled[i];
    const Fit& fit = fits[i];
    const bool isTooLarge = (cause == Cause::focalLength && std::abs(fit.size) > kLargestFocal) ||
                            (cause == Cause::gyroBias && fit.size > kLargestGyroBias) ||
                            (cause == Cause::latency && std::abs(fit.size) > kLargestLatency);
    const bool isCovered = fit.explained < kLeastExplained;
    if (isTooLarge || isCovered || fit.evidence < evidence) continue;
    const bool isTooSmall =
        (cause == Cause::latency && isNoisy && std::abs(fit.size) < kLeastLatency * dt_) ||
        (cause == Cause::movingTarget && fit.size < kLeastSpeed);
    if (!isTooSmall && fit.explained > best.fit.explained) {
      best = {cause, fit, best.cause, best.fit.explained};
    } else if (fit.explained > best.explainedByNext) {
      best.next = cause;
      best.explainedByNext = fit.explained;
    }
  }
  return best;
}

/// Names the cause that explains most of the innovations, if one has the evidence. \return by how
/// much it lowers the sum of NIS
double ConsistencyMonitor::judgeModel(const Fits& fits, Diagnosis& d) const {
  const Likeliest best = likeliest(fits, options_.evidence);
  if (best.cause == Cause::none) return 0;
  d.cause = best.cause;
  d.evidence = best.fit.evidence;
  d.size = best.fit.size;
  if (best.explainedByNext >= kRivals * best.fit.explained) d.rival = best.next;
  return best.fit.explained;
}

void ConsistencyMonitor::judgeNoise(Diagnosis& d) const {
  const Nis nis = windowedNis();
  const double expected = kExpectedRejections * measured_;
  const bool othersAgree = nis.mean < kOthersAgree;
  if (othersAgree && rejected_ > kRejectionFactor * expected + kRejectionSlack) {
    d.cause = Cause::outliers;
    d.size = rejected_ / measured_;
    d.evidence = (rejected_ - expected) / std::sqrt(std::max(1., expected));
  } else if (above_s_ >= options_.hold_s || below_s_ >= options_.hold_s) {
    d.cause = Cause::noise;
    d.size = nis.mean / 2;
    d.evidence = std::abs(nis.deviation);
  }
}

ConsistencyMonitor::Diagnosis ConsistencyMonitor::diagnosis() const {
  if (held_s_ >= (latest_.cause == Cause::motion ? kMotionAgreed_s : kAgreed_s)) return latest_;
  Diagnosis undecided;
  undecided.meanNis = latest_.meanNis;
  undecided.values = latest_.values;
  undecided.rejected = latest_.rejected;
  return undecided;
}

}  // namespace depthservo
