#pragma once

#include "depthservo/features/ObservedPoint.h"
#include "depthservo/features/ObservingFeature.h"

namespace depthservo {

/// What the drop-ins for features with one depth Z have in common.
template <typename VispFeature>
class ObservingPointFeature : public ObservingFeature<VispFeature> {
 public:
  /// What errs on this robot, and so what sigma contains: ErrorProfile::typical() for wheels and a
  /// gyro, ErrorProfile() for a perfect robot. Replaces the estimator; call it before the first
  /// `observe`, later calls start the depth anew at the estimate.
  void setErrors(const ErrorProfile& errors) { point_.setErrors(errors); }

  /// Image noise: standard deviation per axis [px], > 0. Default 8e-4 normalised (0.5 px at 600
  /// px). \rtsafe
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam) {
    point_.setNoise(sigma_px, cam);
  }

  /// What the servo is given while the observed depth is vague. `blended` (default): while
  /// `DepthEstimate::isDoubtful` no depth beyond the larger of Z* and the near end of the interval;
  /// without Z* the near end alone. Doubt slows the robot down, never up. `observed`: the estimate
  /// as it is. \rtsafe
  void setServoDepth(ServoDepth choice) { point_.setServoDepth(choice); }

  /// The depth at the goal, Z* [m]. While the observed depth is vague the servo uses a blend of
  /// both, weighted by their variances (that of the desired one being 0.7/Z); `estimate()` is never
  /// blended. \rtsafe
  void setDesiredDepth(double depth) { point_.setDesiredDepth(depth); }

  /// The point and its depth at the last `observe`; status `unset` before the first.
  const DepthEstimate& estimate() const { return point_.estimate(); }

 protected:
  void forget() override { point_.reset(this->get_Z()); }
  void makeUsable() override {
    const double depth = point_.usable(this->get_Z());
    if (depth != this->get_Z()) this->set_Z(depth);
  }
  void describe(std::ostream& out) const override { detail::describeDepth(out, estimate()); }

  ObservedPoint point_;
};

}  // namespace depthservo
