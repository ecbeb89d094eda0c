#pragma once

#include "depthservo/features/ObservedPoint.h"
#include "depthservo/features/ObservingFeature.h"

namespace depthservo {

/// What the drop-ins for features with one depth Z have in common.
template <typename VispFeature>
class ObservingPointFeature : public ObservingFeature<VispFeature> {
 public:
  /// As of FeaturePoint.
  void setErrors(const ErrorProfile& errors) { point_.setErrors(errors); }
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam) {
    point_.setNoise(sigma_px, cam);
  }
  void setServoDepth(ServoDepth choice) { point_.setServoDepth(choice); }
  void setDesiredDepth(double depth) { point_.setDesiredDepth(depth); }
  const DepthEstimate& estimate() const { return point_.estimate(); }

 protected:
  void forget() override { point_.reset(this->get_Z()); }
  void makeUsable() override {
    const double depth = point_.usable(this->get_Z());
    if (depth != this->get_Z()) this->set_Z(depth);
  }
  void describe(std::ostream& out) const override {
    if (!point_.isObserved()) return;
    out << "Observed: Z=" << estimate().Z() << " sigma_Z=" << estimate().sigma_Z() << " ("
        << estimate().status << ")" << std::endl;
  }

  ObservedPoint point_;
};

}  // namespace depthservo
