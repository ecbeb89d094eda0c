#include "depthservo/features/FeaturePoint.h"

#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpMeterPixelConversion.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/visp/using.h"
#include "features/toTwist.h"

namespace depthservo {
namespace {

constexpr double kDefaultFocal_px = 600, kDefaultSigma = 8e-4;  // half a pixel

/// Sigma of the desired inverse depth, as a fraction of it, in the blend.
constexpr double kDesiredRelativeSigma = 0.7;

/// ViSP refuses Z below this [m].
constexpr double kSmallestZ = 1e-6;

/// Where a depth is set at every image, one that differs from the last by this factor is new.
constexpr double kNewDepth = 1.5;

/// ViSP's default depth of a feature [m], which nobody has set.
constexpr double kDefaultZ = 1;

bool isUsableDepth(double Z) { return std::isfinite(Z) && Z >= kSmallestZ; }

/// Whether the estimate is of a point that was measured (and believed) in the last image.
bool isMeasured(DepthStatus status) {
  return status == DepthStatus::converging || status == DepthStatus::valid ||
         status == DepthStatus::unexcited;
}

/// Whether somebody has set the depth of a feature, as far as ViSP lets one see it: its flag is up
/// until ViSP asks for the interaction matrix.
bool hasStatedDepth(const vpFeaturePoint& feature) {
  struct Access : vpFeaturePoint {
    static bool isZSet(const vpFeaturePoint& f) {
      const bool* const flags = f.*(&Access::flags);
      return flags && flags[2];
    }
  };
  return isUsableDepth(feature.get_Z()) &&
         (feature.get_Z() != kDefaultZ || Access::isZSet(feature));
}

template <typename Pixel>
void displayDepth(const DepthEstimate& estimate, const vpCameraParameters& cam,
                  const vpImage<Pixel>& I, const vpColor& color) {
  vpImagePoint point;
  vpMeterPixelConversion::convertPoint(cam, estimate.x, estimate.y, point);
  char text[64];
  std::snprintf(text, sizeof text, "%.2f +- %.2f m", estimate.Z(), 2 * estimate.sigma_Z());
  vpDisplay::displayText(I, point + vpImagePoint(-10, 10), text, color);
}

}  // namespace

FeaturePoint::FeaturePoint() : FeaturePoint(InverseDepthFilter()) {
  hasErrors_ = true;
  errors_ = ErrorProfile::arm();
  considerErrors();
}

FeaturePoint::FeaturePoint(const DepthEstimator& estimator, const DepthRange& range)
    : estimator_(estimator.clone()),
      focal_px_(kDefaultFocal_px),
      range_(range),
      sigma_(kDefaultSigma),
      Z_written_(get_Z()),
      Z_usable_(get_Z()),
      Z_told_(get_Z()) {}

FeaturePoint::FeaturePoint(const FeaturePoint& other) : FeaturePoint() { *this = other; }

FeaturePoint& FeaturePoint::operator=(const FeaturePoint& other) {
  if (this == &other) return *this;
  vpFeaturePoint::operator=(other);
  deallocate = user;  // this object belongs to whoever declared it, whoever owned the other
  for (unsigned i = 0; i < nbParameters; ++i) flags[i] = other.flags[i];
  estimator_ = other.estimator_ ? other.estimator_->clone() : nullptr;
  hasErrors_ = other.hasErrors_;
  errors_ = other.errors_;
  focal_px_ = other.focal_px_;
  range_ = other.range_;
  estimate_ = other.estimate_;
  sigma_ = other.sigma_;
  Z_written_ = other.Z_written_;
  Z_usable_ = other.Z_usable_;
  Z_desired_ = other.Z_desired_;
  Z_desiredOfGroup_ = other.Z_desiredOfGroup_;
  cautionOfGroup_ = other.cautionOfGroup_;
  Z_ofOthers_ = other.Z_ofOthers_;
  servoDepthChoice_ = other.servoDepthChoice_;
  desiredIsGiven_ = other.desiredIsGiven_;
  interactionAsked_ = other.interactionAsked_;
  depthUnused_ = other.depthUnused_;
  motion_ = other.motion_;
  Z_told_ = other.Z_told_;
  wasDepthSet_ = other.wasDepthSet_;
  isDepthSetAlways_ = other.isDepthSetAlways_;
  depthsSet_ = other.depthsSet_;
  restarts_ = other.restarts_;
  return *this;
}

void FeaturePoint::init() {
  vpFeaturePoint::init();
  estimate_ = {};
  Z_written_ = Z_usable_ = Z_told_ = get_Z();
  Z_desired_ = Z_desiredOfGroup_ = Z_ofOthers_ = 0;
  cautionOfGroup_ = 1;
  desiredIsGiven_ = interactionAsked_ = depthUnused_ = false;
  wasDepthSet_ = isDepthSetAlways_ = false;
  depthsSet_ = restarts_ = 0;
  motion_ = {};
}

FeaturePoint* FeaturePoint::duplicate() const { return new FeaturePoint(*this); }

/// Whether the depth set since the last image, if any, starts the depth anew.
bool FeaturePoint::takesNewDepth() {
  const double depth = get_Z();
  const bool isSet = depth != Z_written_ && isUsableDepth(depth);
  isDepthSetAlways_ = isDepthSetAlways_ || (isSet && wasDepthSet_);
  wasDepthSet_ = isSet;
  if (!isSet) return false;
  const double ratio = depth / Z_told_;
  Z_told_ = depth;
  if (estimate_.status == DepthStatus::unset) return false;  // a guess
  ++depthsSet_;
  const bool isNew = isDepthSetAlways_ ? !(ratio < kNewDepth && ratio * kNewDepth > 1) : ratio != 1;
  if (isNew) ++restarts_;
  return isNew;
}

void FeaturePoint::observe(const vpColVector& twist, double dt) { observe(toMotion(twist, dt)); }

void FeaturePoint::observe(const Motion& told) {
  const Motion motion = motion_.take(told);
  if (!estimator_) return;  // a member of a group is observed by its group
  const bool isNewDepth = takesNewDepth();
  const bool isMeasuredNow = hasNewPoint() && measurement().isUsable();

  if (!(motion.dt > 0)) {
    publish(estimate_);
  } else if (estimate_.status == DepthStatus::unset) {
    if (isMeasuredNow) start(measurement(), {get_Z()});
    publish(isMeasuredNow ? estimator_->estimate() : estimate_);
  } else {
    estimator_->predict(motion);
    if (isNewDepth) {
      const DepthEstimate now = estimator_->estimate();
      start(isMeasuredNow ? measurement() : PointMeasurement{now.x, now.y, sigma_}, {get_Z()});
    } else if (hasNewPoint()) {
      estimator_->correct(measurement());
    }
    publish(estimator_->estimate());
  }
}

void FeaturePoint::start(const PointMeasurement& at, const DepthPrior& prior) {
  estimator_->reset(at, prior);
}

void FeaturePoint::publish(const DepthEstimate& estimate) {
  const bool isNew = hasNewPoint() && measurement().isUsable();
  estimate_ = estimate;
  if (estimate_.status == DepthStatus::unset) {
    if (!measurement().isUsable()) {
      set_x(0);
      set_y(0);
    }
    if (!isUsableDepth(get_Z())) set_Z(Z_usable_);
    return;
  }
  if (!isNew || !isMeasured(estimate_.status)) {
    set_x(estimate_.x);
    set_y(estimate_.y);
  }
  publishDepth(estimate);
  resetFlags();
}

double FeaturePoint::servoDepth() const {
  const DepthEstimate& e = estimate_;
  const double Z_desired = Z_desired_ > 0 ? Z_desired_ : Z_desiredOfGroup_;
  double depth = Z_ofOthers_ > 0 ? Z_ofOthers_ : e.Z();
  if (servoDepthChoice_ == ServoDepth::blended && !(Z_ofOthers_ > 0 && Z_desired == 0)) {
    depth = std::min(e.cautiousZ(), e.Z() / cautionOfGroup_);
    if (Z_desired > 0) {
      const double chi_desired = range_.clampChi(1 / Z_desired);
      const double sigma_desired = kDesiredRelativeSigma * chi_desired;
      const double variance = e.sigma_chi * e.sigma_chi;
      const double variance_desired = sigma_desired * sigma_desired;
      const double blend =
          (variance + variance_desired) / (e.chi * variance_desired + chi_desired * variance);
      depth = e.isDoubtful() ? std::min(blend, std::max(1 / chi_desired, e.cautiousZ())) : blend;
    }
  }
  return std::clamp(depth, range_.Z_min, range_.Z_max);
}

void FeaturePoint::setDepth(double depth, double sigma_depth) {
  if (!estimator_ || estimate_.status == DepthStatus::unset) return;
  if (!isUsableDepth(depth) || !(sigma_depth > 0) || !std::isfinite(sigma_depth)) return;
  estimator_->correctDepth({depth, sigma_depth / (depth * depth)});
  publishDepth(estimator_->estimate());
}

void FeaturePoint::publishDepth(const DepthEstimate& estimate) {
  estimate_ = estimate;
  Z_written_ = Z_usable_ = servoDepth();
  set_Z(Z_written_);
}

void FeaturePoint::setDesiredDepth(double depth) {
  if (!isUsableDepth(depth)) return;
  Z_desired_ = depth;
  desiredIsGiven_ = true;
}

void FeaturePoint::setErrors(const ErrorProfile& errors) {
  if (!estimator_) return;  // a member of a group, which has an estimator of its own
  if (!hasErrors_) estimator_ = std::make_unique<InverseDepthFilter>();
  hasErrors_ = true;
  errors_ = errors;
  considerErrors();
  const DepthEstimate& e = estimate_;
  if (e.status != DepthStatus::unset) start({e.x, e.y, sigma_}, {e.Z()});
}

void FeaturePoint::considerErrors() {
  static_cast<InverseDepthFilter&>(*estimator_) =
      InverseDepthFilter(InverseDepthFilter::Options::considering(errors_, focal_px_), range_);
}

void FeaturePoint::setNoise(double sigma_px, const vpCameraParameters& cam) {
  const double focal_px = std::sqrt(std::abs(cam.get_px() * cam.get_py()));
  const double sigma = sigma_px / focal_px;
  if (!(sigma > 0 && std::isfinite(sigma))) return;
  sigma_ = sigma;
  focal_px_ = focal_px;
  if (hasErrors_ && estimate_.status == DepthStatus::unset) considerErrors();
}

vpMatrix FeaturePoint::interaction(unsigned int select) {
  interactionAsked_ = true;
  if (isUsableDepth(get_Z())) {
    Z_usable_ = get_Z();
  } else {
    set_Z(Z_usable_);
  }
  setFlags();  // so that ViSP's debug builds do not warn about a Z that was observed, not set
  return vpFeaturePoint::interaction(select);
}

vpColVector FeaturePoint::error(const vpBasicFeature& s_star, unsigned int select) {
  depthUnused_ = !interactionAsked_;
  interactionAsked_ = false;
  if (!desiredIsGiven_) {
    const auto* desired = dynamic_cast<const vpFeaturePoint*>(&s_star);
    if (desired && hasStatedDepth(*desired)) Z_desired_ = desired->get_Z();
  }
  return vpFeaturePoint::error(s_star, select);
}

void FeaturePoint::print(unsigned int select) const {
  vpFeaturePoint::print(select);
  if (estimate_.status == DepthStatus::unset) return;
  std::cout << "Observed: Z=" << estimate_.Z() << " sigma_Z=" << estimate_.sigma_Z() << " ("
            << estimate_.status << ")" << std::endl;
  if (unknownFor_s() > 0) {
    std::cout << "The camera's motion is unknown for " << unknownFor_s() << " s: " << refused()
              << " twists could not be used" << std::endl;
  }
  if (depthsSet_ > 0) {
    std::cout << "Z was set before " << depthsSet_ << " images; it started the depth anew "
              << restarts_ << " times" << std::endl;
  }
}

void FeaturePoint::display(const vpCameraParameters& cam, const vpImage<unsigned char>& I,
                           const vpColor& color, unsigned int thickness) const {
  vpFeaturePoint::display(cam, I, color, thickness);
  if (estimate_.status != DepthStatus::unset) displayDepth(estimate_, cam, I, color);
}

void FeaturePoint::display(const vpCameraParameters& cam, const vpImage<vpRGBa>& I,
                           const vpColor& color, unsigned int thickness) const {
  vpFeaturePoint::display(cam, I, color, thickness);
  if (estimate_.status != DepthStatus::unset) displayDepth(estimate_, cam, I, color);
}

}  // namespace depthservo
