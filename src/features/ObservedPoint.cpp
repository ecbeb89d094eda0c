#include "depthservo/features/ObservedPoint.h"

#include <cmath>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

constexpr double kDefaultFocal_px = 600, kDefaultSigma = 8e-4;  // half a pixel

/// Whether the estimate is of a point that was measured (and believed) in the last image.
bool isMeasured(DepthStatus status) {
  return status == DepthStatus::converging || status == DepthStatus::valid ||
         status == DepthStatus::unexcited;
}

}  // namespace

ObservedPoint::ObservedPoint() : ObservedPoint(InverseDepthFilter()) {
  hasErrors_ = true;
  errors_ = ErrorProfile::arm();
  considerErrors();
}

ObservedPoint::ObservedPoint(const DepthEstimator& estimator, const DepthRange& range)
    : estimator_(estimator.clone()),
      focal_px_(kDefaultFocal_px),
      sigma_(kDefaultSigma),
      blend_(range) {}

ObservedPoint::ObservedPoint(const ObservedPoint& other) { *this = other; }

ObservedPoint& ObservedPoint::operator=(const ObservedPoint& other) {
  if (this == &other) return *this;
  estimator_ = other.estimator_ ? other.estimator_->clone() : nullptr;
  hasErrors_ = other.hasErrors_;
  errors_ = other.errors_;
  focal_px_ = other.focal_px_;
  estimate_ = other.estimate_;
  sigma_ = other.sigma_;
  Z_written_ = other.Z_written_;
  Z_usable_ = other.Z_usable_;
  blend_ = other.blend_;
  Z_told_ = other.Z_told_;
  wasDepthSet_ = other.wasDepthSet_;
  isDepthSetAlways_ = other.isDepthSetAlways_;
  depthsSet_ = other.depthsSet_;
  restarts_ = other.restarts_;
  return *this;
}

void ObservedPoint::reset(double Z) {
  estimate_ = {};
  Z_written_ = Z_told_ = Z;
  Z_usable_ = isUsableDepth(Z) ? Z : 1;
  blend_.forget();
  wasDepthSet_ = isDepthSetAlways_ = false;
  depthsSet_ = restarts_ = 0;
}

/// Whether the depth set since the last image, if any, starts the depth anew.
bool ObservedPoint::takesNewDepth(double depth) {
  const bool isSet = depth != Z_written_ && isUsableDepth(depth);
  isDepthSetAlways_ = isDepthSetAlways_ || (isSet && wasDepthSet_);
  wasDepthSet_ = isSet;
  if (!isSet) return false;
  const double ratio = depth / Z_told_;
  Z_told_ = depth;
  if (!isObserved()) return false;  // a guess
  ++depthsSet_;
  const bool isNew = isDepthSetAlways_ ? isOtherDepth(ratio) : ratio != 1;
  if (isNew) ++restarts_;
  return isNew;
}

void ObservedPoint::observe(const Motion& motion, ShownPoint& shown) {
  const bool isNewDepth = takesNewDepth(shown.Z);
  const bool isMeasuredNow = shown.isNew && measured(shown).isUsable();

  if (!(motion.dt > 0)) {
    show(estimate_, shown);
  } else if (!isObserved()) {
    if (isMeasuredNow) estimator_->reset(measured(shown), {shown.Z});
    show(isMeasuredNow ? estimator_->estimate() : estimate_, shown);
  } else {
    estimator_->predict(motion);
    if (isNewDepth) {
      const DepthEstimate now = estimator_->estimate();
      estimator_->reset(isMeasuredNow ? measured(shown) : PointMeasurement{now.x, now.y, sigma_},
                        {shown.Z});
    } else if (shown.isNew) {
      estimator_->correct(measured(shown));
    }
    show(estimator_->estimate(), shown);
  }
}

void ObservedPoint::show(const DepthEstimate& estimate, ShownPoint& shown) {
  const bool isUsable = measured(shown).isUsable();
  estimate_ = estimate;
  if (!isObserved()) {
    if (!isUsable) shown.x = shown.y = 0;
    if (!isUsableDepth(shown.Z)) shown.Z = Z_usable_;
    return;
  }
  if (!shown.isNew || !isUsable || !isMeasured(estimate_.status)) {
    shown.x = estimate_.x;
    shown.y = estimate_.y;
  }
  shown.Z = take(estimate);
}

double ObservedPoint::take(const DepthEstimate& estimate) {
  estimate_ = estimate;
  return Z_written_ = Z_usable_ = servoDepth();
}

bool ObservedPoint::setDepth(double depth, double sigma_depth) {
  if (!estimator_ || !isObserved()) return false;
  if (!isUsableDepth(depth) || !(sigma_depth > 0) || !std::isfinite(sigma_depth)) return false;
  estimator_->correctDepth({depth, sigma_depth / (depth * depth)});
  take(estimator_->estimate());
  return true;
}

double ObservedPoint::usable(double Z) {
  if (isUsableDepth(Z)) Z_usable_ = Z;
  return Z_usable_;
}

void ObservedPoint::setErrors(const ErrorProfile& errors) {
  if (!estimator_) return;  // a member of a group, which has an estimator of its own
  if (!hasErrors_) estimator_ = std::make_unique<InverseDepthFilter>();
  hasErrors_ = true;
  errors_ = errors;
  considerErrors();
  const DepthEstimate& e = estimate_;
  if (isObserved()) estimator_->reset({e.x, e.y, sigma_}, {e.Z()});
}

void ObservedPoint::considerErrors() {
  static_cast<InverseDepthFilter&>(*estimator_) = InverseDepthFilter(
      InverseDepthFilter::Options::considering(errors_, focal_px_), blend_.range());
}

void ObservedPoint::setNoise(double sigma_px, const vpCameraParameters& cam) {
  const double focal_px = std::sqrt(std::abs(cam.get_px() * cam.get_py()));
  const double sigma = sigma_px / focal_px;
  if (!(sigma > 0 && sigma <= PointMeasurement::kLargestSigma)) return;
  sigma_ = sigma;
  focal_px_ = focal_px;
  if (hasErrors_ && !isObserved()) considerErrors();
}

}  // namespace depthservo
