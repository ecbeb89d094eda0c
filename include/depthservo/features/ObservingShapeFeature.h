#pragma once

#include "depthservo/features/DepthBlend.h"
#include "depthservo/features/ObservingFeature.h"

namespace depthservo {

/// What the drop-ins for features of a shape, with a plane or a line in space, have in common.
template <typename VispFeature>
class ObservingShapeFeature : public ObservingFeature<VispFeature> {
 public:
  /// As of FeaturePoint; the depth is that of `estimate`. \rtsafe
  void setServoDepth(ServoDepth choice) { blend_.setChoice(choice); }
  void setDesiredDepth(double depth) { blend_.setDesired(depth); }

  /// Where the shape's depth is meant, and that depth, at the last `observe`.
  const DepthEstimate& estimate() const { return estimate_; }

 protected:
  void makeUsable() override {}
  void describe(std::ostream& out) const override { detail::describeDepth(out, estimate_); }
  bool isObserved() const { return estimate_.status != DepthStatus::unset; }

  DepthEstimate estimate_;
  DepthBlend blend_;
};

}  // namespace depthservo
