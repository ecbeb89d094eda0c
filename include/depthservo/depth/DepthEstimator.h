#pragma once

#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"

namespace depthservo {

/// Observes the depth of one still point from its images and the motion of the camera.
///
/// Call order: `reset` with the first measurement, then for each image `predict` with the motion
/// since the last call (any number of times), and `correct` if the point was measured. An image in
/// which the point is hidden has no `correct`: the estimate then coasts.
///
/// Contract of every implementation: after construction nothing allocates, locks, prints or throws;
/// any input is allowed, non-finite ones are ignored and show in the status; `estimate()` is always
/// finite with Z within the estimator's range. Copies (`clone`) are independent. One thread per
/// object.
class DEPTHSERVO_API DepthEstimator {
 public:
  virtual ~DepthEstimator() = default;
  virtual std::unique_ptr<DepthEstimator> clone() const = 0;

  /// Starts anew at this measurement. Ignored when the measurement is not usable.
  virtual void reset(const PointMeasurement& measurement, const DepthPrior& prior) = 0;

  /// Follows the camera's motion since the last `predict`. Motions that are not usable
  /// (`Motion::isUsable`) are ignored. Where the motion is unknown in part (`Motion::unknown`)
  /// sigma grows as `widened` says, the status is `coasting`, measured or not, and the next
  /// `correct` says where the point is, and nothing of its depth.
  virtual void predict(const Motion& motion) = 0;

  /// Corrects with the image taken now; refers to all motion since the last `correct`.
  virtual void correct(const PointMeasurement& measurement) = 0;

  /// Fuses a direct measurement of the depth (a range sensor, a tag) taken now.
  virtual void correctDepth(const DepthPrior& measured) = 0;

  virtual DepthEstimate estimate() const = 0;

 protected:
  DepthEstimator() = default;
  DepthEstimator(const DepthEstimator&) = default;
  DepthEstimator& operator=(const DepthEstimator&) = default;
};

}  // namespace depthservo
