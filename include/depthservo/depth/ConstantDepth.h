#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"

namespace depthservo {

/// The baseline: Z is what was given and never changes, as with a plain vpFeaturePoint. Image
/// coordinates are measured; while the point is hidden they are predicted with that Z. It learns
/// nothing, and says so: its status is never better than `unexcited`, its sigma that of the prior.
class DEPTHSERVO_API ConstantDepth : public DepthEstimator {
 public:
  explicit ConstantDepth(const DepthRange& range = {}) : range_(range) {}

  std::unique_ptr<DepthEstimator> clone() const override;
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override;
  void predict(const Motion& motion) override;
  void correct(const PointMeasurement& measurement) override;
  void correctDepth(const DepthPrior& measured) override;
  DepthEstimate estimate() const override { return estimate_; }

 private:
  void takePoint(const PointMeasurement& measurement);
  DepthStatus judged() const;

  DepthRange range_;
  DepthEstimate estimate_;
  bool isMotionKnown_ = true;  // of the last motion
};

}  // namespace depthservo
