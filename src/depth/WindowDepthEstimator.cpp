#include "depthservo/depth/WindowDepthEstimator.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Translation [m] below which two images are taken from the same place.
constexpr double kSamePlace = 1e-9;

/// A point so far off the axis, normalised, is beside the camera: 89.99 degrees.
constexpr double kBeside = 5000;

/// Slack [s] of the least time between kept images: times are sums and differences.
constexpr double kTimeSlack_s = 1e-6;

/// A fit vaguer than this times the sharpest so far is not taken ...
constexpr double kVaguer = 2;
/// ... unless it differs by this many of its sigma.
constexpr double kContradiction = 4;

/// Standard deviations of the chi-square that the images' distances may reach.
constexpr double kMisfit = 5;

/// 1-sigma of the point along the worse direction in the image.
double imageSigma(const Eigen::Matrix3d& covariance) {
  const double a = covariance(0, 0), b = covariance(0, 1), c = covariance(1, 1);
  const double half = 0.5 * (a + c);
  return std::sqrt(half + std::hypot(0.5 * (a - c), b));
}

/// How much the fit's sigma must grow for its distances to the images to be likely.
double misfit(const WindowFit& fit) {
  const double likely = fit.dof + kMisfit * std::sqrt(2.0 * fit.dof);
  return fit.dof > 0 && fit.cost > likely ? std::sqrt(fit.cost / fit.dof) : 1;
}

}  // namespace

WindowDepthEstimator::WindowDepthEstimator(const Options& options, const DepthRange& range)
    : options_(options), range_(range), earlier_(std::max<std::size_t>(1, options.images)) {}

std::unique_ptr<DepthEstimator> WindowDepthEstimator::clone() const {
  return std::make_unique<WindowDepthEstimator>(*this);
}

void WindowDepthEstimator::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  const DepthPrior usable = prior.sanitised(range_);
  size_ = oldest_ = 0;
  sinceLastKept_s_ = 0;
  newest_ = {measurement, {}, {}};
  if (usable.sigma_chi < DepthPrior::kWideSigma_chi) {
    newest_.depth = {1 / usable.Z, usable.sigma_chi};
  }
  held_.point.chi = 1 / usable.Z;
  held_.covariance.setZero();
  held_.covariance(2, 2) = usable.sigma_chi * usable.sigma_chi;
  isLearnt_ = false;
  sharpest_ = usable.sigma_chi;
  vaguest_ = std::max(usable.sigma_chi, DepthPrior::kWideSigma_chi);
  sinceNewest_ = {};
  rejections_ = 0;
  isMotionKnown_ = true;
  fitWindow();
  estimate_ = {};
  publish(held_);
  estimate_.status = measuredStatus();
}

WindowDepthEstimator::Prediction WindowDepthEstimator::predictedNow() const {
  const Flow now = flow(sinceNewest_, held_.point);
  if (!now.ahead || std::hypot(now.point.x, now.point.y) > kBeside) return {held_, false};
  const Eigen::Matrix3d J = flowJacobian(sinceNewest_, held_.point, now.point);
  const Held next{now.point, J * held_.covariance * J.transpose()};
  if (!next.covariance.allFinite()) return {held_, false};
  return {next, true};
}

void WindowDepthEstimator::predict(const Motion& motion) {
  if (estimate_.status == DepthStatus::unset || !motion.isUsable()) return;
  sinceNewest_ = sinceNewest_.then(motion);
  const Prediction now = predictedNow();
  if (!now.ahead) {
    estimate_.status = DepthStatus::lost;
    return;
  }
  const Eigen::Vector2d m(now.held.point.x, now.held.point.y);
  const double across = (motion.t.head<2>() - m * motion.t.z()).norm() / motion.dt;
  if (std::isfinite(across)) estimate_.excitation = across;
  publish(now.held);
  isMotionKnown_ = !motion.unknown.exists();
  if (!isMotionKnown_) letDrift(motion.unknown);
  estimate_.status =
      estimate_.sigma_xy > options_.lost_sigma ? DepthStatus::lost : DepthStatus::coasting;
}

/// The window starts anew where the point may be now.
void WindowDepthEstimator::letDrift(const UnknownPart& unknown) {
  const DepthEstimate e = estimate_;
  const PointSigmas wide = widened({e.sigma_xy, e.sigma_chi}, {e.x, e.y, e.chi}, unknown);
  reset({e.x, e.y, wide.xy}, {e.Z(), wide.chi});
  estimate_.excitation = e.excitation;
  estimate_.sigma_xy = wide.xy;
  isLearnt_ = isMotionKnown_ = false;
}

void WindowDepthEstimator::publish(const Held& now) {
  estimate_.x = now.point.x;
  estimate_.y = now.point.y;
  estimate_.chi = range_.clampChi(now.point.chi);
  estimate_.sigma_chi = std::sqrt(std::max(0.0, now.covariance(2, 2)));
  estimate_.sigma_xy = imageSigma(now.covariance);
}

void WindowDepthEstimator::correct(const PointMeasurement& measurement) {
  if (estimate_.status == DepthStatus::unset) return;
  if (!measurement.isUsable()) {
    if (estimate_.status != DepthStatus::lost) estimate_.status = DepthStatus::rejected;
    return;
  }
  const Prediction prediction = predictedNow();
  if (!isPlausible(prediction, measurement)) {
    estimate_.status = DepthStatus::rejected;
    if (++rejections_ > options_.rejectionsInARow) reset(measurement, {estimate_.Z()});
    return;
  }
  rejections_ = 0;
  if (prediction.ahead) {
    const double grown = std::sqrt(prediction.held.covariance(2, 2) / held_.covariance(2, 2));
    if (std::isfinite(grown)) sharpest_ *= grown;
    held_ = prediction.held;
  }
  takeImage(measurement);
  fitWindow();
  publish(held_);
  estimate_.status = measuredStatus();
}

bool WindowDepthEstimator::isPlausible(const Prediction& prediction,
                                       const PointMeasurement& measurement) const {
  if (!sinceNewest_.isFinite()) return false;
  if (!isLearnt_) return true;  // there is nothing to contradict yet
  if (!prediction.ahead) return false;
  const double dx = measurement.x - prediction.held.point.x;
  const double dy = measurement.y - prediction.held.point.y;
  const double sigma = std::hypot(imageSigma(prediction.held.covariance), measurement.sigma);
  return std::hypot(dx, dy) <= std::max(options_.gate, options_.gate_sigma * sigma);
}

void WindowDepthEstimator::takeImage(const PointMeasurement& measurement) {
  const Motion back = sinceNewest_.inverse();
  for (std::size_t i = 0; i < size_; ++i) earlier_[i].toThere = back.then(earlier_[i].toThere);
  const bool isElsewhere = sinceNewest_.t.norm() > kSamePlace || newest_.depth.isKnown();
  const bool isApart = size_ == 0 || !(sinceLastKept_s_ < options_.spacing_s - kTimeSlack_s);
  if (isElsewhere && isApart) {
    WindowImage& kept = earlier_[oldest_];
    kept = newest_;
    kept.toThere = back;
    oldest_ = (oldest_ + 1) % earlier_.size();
    size_ = std::min(size_ + 1, earlier_.size());
    sinceLastKept_s_ = 0;
  }
  sinceLastKept_s_ += sinceNewest_.dt;
  newest_ = {measurement, {}, {}};
  sinceNewest_ = {};
}

void WindowDepthEstimator::fitWindow() {
  const WindowImages images{newest_, earlier_.data(), size_};
  switch (options_.method) {
    case WindowMethod::leastSquares:
      fit_ = fitLeastSquares(images);
      break;
    case WindowMethod::maximumLikelihood:
      fit_ = fitMaximumLikelihood(images);
      break;
    case WindowMethod::robust:
      fit_ = fitRobustly(images);
      break;
  }
  isTaken_ = isWorthTaking(fit_);
  if (isTaken_) {
    isLearnt_ = true;
    const double grow = misfit(fit_);
    held_.point = {fit_.point.x(), fit_.point.y(), range_.clampChi(fit_.chi())};
    held_.covariance = grow * grow * fit_.covariance;
    const double sigma = grow * fit_.sigma_chi();
    const bool isContradiction = sigma > kVaguer * sharpest_;
    sharpest_ = isContradiction ? sigma : std::min(sigma, sharpest_);
  } else {
    const double variance_chi = std::min(held_.covariance(2, 2), vaguest_ * vaguest_);
    const PointMeasurement& m = newest_.point;
    held_.point = {m.x, m.y, range_.clampChi(held_.point.chi)};
    held_.covariance =
        Eigen::Vector3d(m.sigma * m.sigma, m.sigma * m.sigma, variance_chi).asDiagonal();
  }
}

bool WindowDepthEstimator::isWorthTaking(const WindowFit& fit) const {
  if (fit.degeneracy != WindowDegeneracy::none) return false;
  const double sigma = misfit(fit) * fit.sigma_chi();
  double chi = fit.chi() - 2 * sigma;
  if (isLearnt_) chi = std::max(chi, held_.point.chi);
  if (!(sigma <= options_.relativeSigma * chi)) return false;
  if (!isLearnt_) return true;
  return sigma <= kVaguer * sharpest_ ||
         std::abs(fit.chi() - held_.point.chi) > kContradiction * sigma;
}

DepthStatus WindowDepthEstimator::measuredStatus() const {
  if (!isMotionKnown_) return DepthStatus::coasting;
  if (isTaken_) {
    const bool isFound = range_.isFound(estimate_.chi, estimate_.sigma_chi);
    return isFound ? DepthStatus::valid : DepthStatus::converging;
  }
  const bool isLearning = !isLearnt_ && fit_.degeneracy != WindowDegeneracy::noBaseline;
  return isLearning ? DepthStatus::converging : DepthStatus::unexcited;
}

void WindowDepthEstimator::correctDepth(const DepthPrior& measured) {
  if (estimate_.status == DepthStatus::unset || !measured.isUsable()) return;
  const Prediction now = predictedNow();
  if (!now.ahead) return;
  // To where the newest image was taken.
  const PointState here{now.held.point.x, now.held.point.y, range_.clampChi(1 / measured.Z)};
  const Motion back = sinceNewest_.inverse();
  const Flow there = flow(back, here);
  if (!there.ahead) return;
  const double sigma = measured.sigma_chi * std::abs(flowJacobian(back, here, there.point)(2, 2));
  if (!std::isfinite(sigma * sigma)) return;
  const DirectDepth direct{there.point.chi, sigma};
  newest_.depth = newest_.depth.fusedWith(direct);
  const DirectDepth held =
      DirectDepth{held_.point.chi, std::sqrt(held_.covariance(2, 2))}.fusedWith(direct);
  held_.point.chi = held.chi;
  held_.covariance(2, 2) = held.sigma * held.sigma;
  sharpest_ = std::min(sharpest_, held.sigma);

  const DepthStatus status = estimate_.status;
  const bool isHidden = sinceNewest_.dt > 0;
  fitWindow();
  publish(predictedNow().held);
  estimate_.status = isHidden ? status : measuredStatus();
}

}  // namespace depthservo
