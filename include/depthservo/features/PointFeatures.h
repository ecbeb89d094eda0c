#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/features/FeaturePoint.h"

namespace depthservo {

/// Features that are views of the points 0..n-1 of a PointSetEstimator, as vpServo sees them. Their
/// own `observe` does nothing. While a depth is doubtful, and no Z* is known, all depths are scaled
/// down alike (a task with depths out of proportion may not converge), but for those that ran to
/// the near end of the range: where some depths are found, these are given their median; where some
/// features have a Z*, the others are given their mean. Must outlive the task, like ViSP's
/// features. \rtsafe after construction
class DEPTHSERVO_API PointFeatures {
 public:
  PointFeatures(std::size_t count, const DepthRange& range);

  std::size_t size() const { return features_.size(); }
  FeaturePoint& operator[](std::size_t i) { return features_[i]; }
  const FeaturePoint& operator[](std::size_t i) const { return features_[i]; }

  /// Shows the points as of now [s]. At the time of the estimator's last image a point that was
  /// measured stands where it was measured; later, and where it was not, all is predicted.
  /// \param measured in the last image; ids outside 0..n-1 are ignored \rtsafe
  void publish(const PointSetEstimator& estimator, const std::vector<PointObservation>& measured,
               const MotionBuffer& odometry, double now_s);

 protected:
  std::vector<FeaturePoint> features_;

 private:
  std::vector<DepthEstimate> estimates_;  // of the features, now
  std::vector<double> found_;             // depths that are not doubtful [m]
};

}  // namespace depthservo
