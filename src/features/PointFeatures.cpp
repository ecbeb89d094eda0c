#include "depthservo/features/PointFeatures.h"

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
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const int id = static_cast<int>(i);
    if (isLate) features_[i].resetFlags();  // what was measured then is not where the point is now
    features_[i].publish(isLate ? estimator.estimate(id, odometry, now_s) : estimator.estimate(id));
  }
}

}  // namespace depthservo
