#include "depthservo/features/PointFeatures.h"

#include <algorithm>

namespace depthservo {

PointFeatures::PointFeatures(std::size_t count, const DepthRange& range) : features_(count) {
  for (FeaturePoint& feature : features_) {
    feature.estimator_ = nullptr;
    feature.range_ = range;
  }
}

void PointFeatures::publish(const PointSetEstimator& estimator,
                            const std::vector<PointObservation>& measured,
                            const MotionBuffer& odometry, double now_s) {
  const bool isLate = now_s > estimator.time();
  for (const PointObservation& point : measured) {
    const auto i = static_cast<std::size_t>(point.id);
    if (i >= features_.size()) continue;
    features_[i].set_x(point.measurement.x);
    features_[i].set_y(point.measurement.y);
  }
  const auto estimateOf = [&](std::size_t i) {
    const int id = static_cast<int>(i);
    return isLate ? estimator.estimate(id, odometry, now_s) : estimator.estimate(id);
  };
  double caution = 1, Z_desiredSum = 0;
  int desired = 0;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate e = estimateOf(i);
    if (e.status != DepthStatus::unset) caution = std::max(caution, e.Z() / e.cautiousZ());
    if (features_[i].Z_desired_ > 0) {
      Z_desiredSum += features_[i].Z_desired_;
      ++desired;
    }
  }
  for (std::size_t i = 0; i < features_.size(); ++i) {
    FeaturePoint& feature = features_[i];
    feature.cautionOfGroup_ = caution;
    feature.Z_desiredOfGroup_ = desired > 0 ? Z_desiredSum / desired : 0;
    if (isLate) feature.resetFlags();  // what was measured then is not where the point is now
    feature.publish(estimateOf(i));
  }
}

}  // namespace depthservo
