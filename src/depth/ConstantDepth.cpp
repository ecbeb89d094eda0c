#include "depthservo/depth/ConstantDepth.h"

#include <algorithm>

namespace depthservo {

std::unique_ptr<DepthEstimator> ConstantDepth::clone() const {
  return std::make_unique<ConstantDepth>(*this);
}

void ConstantDepth::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  const DepthPrior usable = prior.sanitised(range_);
  estimate_ = {};
  isMotionKnown_ = true;
  estimate_.chi = 1 / usable.Z;
  estimate_.sigma_chi = usable.sigma_chi;
  takePoint(measurement);
}

void ConstantDepth::predict(const Motion& motion) {
  if (estimate_.status == DepthStatus::unset || !motion.isUsable()) return;
  const double chi = estimate_.chi, sigma_chi = estimate_.sigma_chi;
  isMotionKnown_ = !motion.unknown.exists();
  estimate_ = predicted(estimate_, motion, range_);
  estimate_.chi = chi;
  estimate_.sigma_chi =
      isMotionKnown_ ? sigma_chi
                     : widened({0, sigma_chi}, {estimate_.x, estimate_.y, chi}, motion.unknown).chi;
  if (estimate_.status != DepthStatus::lost) estimate_.status = DepthStatus::coasting;
}

void ConstantDepth::correct(const PointMeasurement& measurement) {
  if (estimate_.status == DepthStatus::unset) return;
  if (!measurement.isUsable()) {
    if (estimate_.status != DepthStatus::lost) estimate_.status = DepthStatus::rejected;
    return;
  }
  takePoint(measurement);
}

void ConstantDepth::takePoint(const PointMeasurement& measurement) {
  estimate_.x = measurement.x;
  estimate_.y = measurement.y;
  estimate_.sigma_xy = measurement.sigma;
  estimate_.status = judged();
  if (!isMotionKnown_) estimate_.status = whileMotionIsUnknown(estimate_.status);
}

void ConstantDepth::correctDepth(const DepthPrior& measured) {
  if (estimate_.status == DepthStatus::unset || !measured.isUsable()) return;
  estimate_.chi = range_.clampChi(1 / measured.Z);
  estimate_.sigma_chi = std::min(measured.sigma_chi, DepthPrior::kLargestSigma_chi);
  const bool isJudged =
      estimate_.status == DepthStatus::valid || estimate_.status == DepthStatus::unexcited;
  if (isJudged) estimate_.status = judged();
}

DepthStatus ConstantDepth::judged() const {
  const bool isFound = range_.isFound(estimate_.chi, estimate_.sigma_chi);
  return isFound ? DepthStatus::valid : DepthStatus::unexcited;
}

}  // namespace depthservo
