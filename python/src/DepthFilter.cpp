#include "DepthFilter.h"

#include <algorithm>
#include <cmath>

namespace depthservo::python {

BatchEngine::BatchEngine(std::size_t size, const InverseDepthFilterOptions& options,
                         const DepthPrior& prior, const DepthRange& range)
    : filter_(size, options, range),
      priors_(size, prior),
      isStarted_(size, 0),
      waiting_(size),
      x_(size),
      y_(size),
      sigma_(size) {}

void BatchEngine::setPrior(std::size_t i, const DepthPrior& prior) {
  priors_[i] = prior;
  waiting_ += isStarted_[i] != 0;
  isStarted_[i] = 0;
}

void BatchEngine::startAnew() {
  for (std::size_t i = 0; i < isStarted_.size(); ++i) {
    if (isStarted_[i] != 0) setPrior(i, {filter_.estimate(i).Z()});
  }
}

Coverage BatchEngine::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {
    time_s_ = time_s;
    return Coverage::complete;
  }
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) return coverage;
  if (hasMotion(coverage)) {
    filter_.predict(motion);
  } else {
    startAnew();
  }
  time_s_ = time_s;
  return coverage;
}

void BatchEngine::correct(const double* xy, double sigma) {
  const std::size_t n = x_.size();
  for (std::size_t i = 0; i < n; ++i) {
    x_[i] = xy[2 * i];
    y_[i] = xy[2 * i + 1];
  }
  std::fill(sigma_.begin(), sigma_.end(), sigma);
  if (waiting_ == 0) return filter_.correct(x_.data(), y_.data(), sigma_.data());

  std::vector<std::size_t> starting;
  for (std::size_t i = 0; i < n; ++i) {
    if (isStarted_[i] != 0) continue;
    if (PointMeasurement{x_[i], y_[i], sigma}.isUsable()) starting.push_back(i);
    x_[i] = std::numeric_limits<double>::quiet_NaN();
  }
  filter_.correct(x_.data(), y_.data(), sigma_.data());
  for (const std::size_t i : starting) {
    filter_.reset(i, {xy[2 * i], xy[2 * i + 1], sigma}, priors_[i]);
    isStarted_[i] = 1;
    --waiting_;
  }
}

void BatchEngine::correctDepth(std::size_t i, const DepthPrior& measured) {
  if (isStarted_[i] != 0) filter_.correctDepth(i, measured);
}

DepthEstimate BatchEngine::estimate(std::size_t i) const { return filter_.estimate(i); }

SetEngine::SetEngine(std::size_t size, std::unique_ptr<PointSetEstimator> estimator)
    : size_(size), estimator_(std::move(estimator)) {
  observations_.reserve(size);
}

void SetEngine::setPrior(std::size_t i, const DepthPrior& prior) {
  estimator_->setPrior(static_cast<int>(i), prior);
}

Coverage SetEngine::advance(const MotionBuffer& odometry, double time_s) {
  return estimator_->advance(odometry, time_s);
}

void SetEngine::correct(const double* xy, double sigma) {
  observations_.clear();
  for (std::size_t i = 0; i < size_; ++i) {
    if (std::isnan(xy[2 * i]) || std::isnan(xy[2 * i + 1])) continue;
    observations_.push_back({static_cast<int>(i), {xy[2 * i], xy[2 * i + 1], sigma}});
  }
  estimator_->correct(observations_);
}

void SetEngine::correctDepth(std::size_t i, const DepthPrior& measured) {
  estimator_->correctDepth(static_cast<int>(i), measured);
}

DepthEstimate SetEngine::estimate(std::size_t i) const {
  return estimator_->estimate(static_cast<int>(i));
}

namespace {

std::vector<py::ssize_t> withTwo(std::vector<py::ssize_t> shape) {
  shape.push_back(2);
  return shape;
}

}  // namespace

Estimates::Estimates(const std::vector<py::ssize_t>& shape)
    : xy(withTwo(shape)),
      z(shape),
      sigma_z(shape),
      z_low(shape),
      z_high(shape),
      excitation(shape),
      status(shape) {}

Estimates::Rows Estimates::rows() {
  return {xy.mutable_data(),    z.mutable_data(),      sigma_z.mutable_data(),
          z_low.mutable_data(), z_high.mutable_data(), excitation.mutable_data(),
          status.mutable_data()};
}

void Estimates::Rows::set(std::size_t i, const DepthEstimate& estimate) const {
  const auto [low, high] = estimate.interval();
  xy[2 * i] = estimate.x;
  xy[2 * i + 1] = estimate.y;
  z[i] = estimate.Z();
  sigma_z[i] = estimate.sigma_Z();
  z_low[i] = low;
  z_high[i] = high;
  excitation[i] = estimate.excitation;
  status[i] = static_cast<std::uint8_t>(estimate.status);
}

}  // namespace depthservo::python
