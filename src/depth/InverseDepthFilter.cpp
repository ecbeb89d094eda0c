#include "depthservo/depth/InverseDepthFilter.h"

#include "depth/FilterPointSteps.h"

namespace depthservo {

std::unique_ptr<DepthEstimator> InverseDepthFilter::clone() const {
  return std::make_unique<InverseDepthFilter>(*this);
}

void InverseDepthFilter::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  detail::resetPoint(point_, measurement, prior.sanitised(range_));
  step_ = {};
  dt_ = 0;
}

void InverseDepthFilter::predict(const Motion& motion) {
  if (!motion.isFinite() || !(motion.dt > 0)) return;
  step_ = options_.odometry.over(motion);
  dt_ = motion.dt;
  detail::predictPoint(point_, detail::FilterStep(motion, step_), options_);
}

void InverseDepthFilter::correct(const PointMeasurement& measurement) {
  detail::correctPoint(point_, measurement, options_, range_);
}

void InverseDepthFilter::correctDepth(const DepthPrior& measured) {
  if (measured.isUsable()) detail::correctPointDepth(point_, measured, range_);
}

DepthEstimate InverseDepthFilter::estimate() const {
  return detail::describePoint(point_, step_, dt_, options_, range_);
}

Eigen::Matrix3d InverseDepthFilter::covariance() const { return detail::covariance(point_); }

}  // namespace depthservo
