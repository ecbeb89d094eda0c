#include "depthservo/features/FeaturePointGroup.h"

#include "features/toTwist.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {

FeaturePointGroup::FeaturePointGroup(const PointSetEstimator& estimator, std::size_t count)
    : PointFeatures(count, estimator.range()), estimator_(estimator.clone()) {
  estimator_->reset();
  observations_.reserve(count);
}

void FeaturePointGroup::observe(const vpColVector& twist, double dt) {
  observe(isTwist(twist) && dt > 0 ? Motion::fromTwist(toTwist(twist), dt) : Motion());
}

void FeaturePointGroup::observe(const Motion& motion) {
  if (!motion.isUsable()) {
    for (FeaturePoint& feature : features_) {
      ++feature.refused_;
      feature.publish(feature.estimate_);
    }
    return;
  }
  odometry_.push(clock_s_, motion.twist());
  clock_s_ += motion.dt;
  odometry_.holdUntil(clock_s_);
  observe(odometry_, clock_s_);
}

Coverage FeaturePointGroup::observe(const MotionBuffer& odometry, double time_s) {
  return observe(odometry, time_s, time_s);
}

Coverage FeaturePointGroup::observe(const MotionBuffer& odometry, double exposure_s, double now_s) {
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const FeaturePoint& feature = features_[i];
    const bool isFirst = feature.estimate_.status == DepthStatus::unset;
    if (isFirst || feature.hasNewDepth()) {
      estimator_->setPrior(static_cast<int>(i), {feature.get_Z()});
    }
  }
  const Coverage coverage = estimator_->advance(odometry, exposure_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) {
    for (FeaturePoint& feature : features_) feature.publish(feature.estimate_);
    return coverage;
  }
  observations_.clear();
  for (std::size_t i = 0; i < features_.size(); ++i) {
    if (features_[i].hasNewPoint()) {
      observations_.push_back({static_cast<int>(i), features_[i].measurement()});
    }
  }
  estimator_->correct(observations_);
  publish(*estimator_, observations_, odometry, now_s);
  return coverage;
}

void FeaturePointGroup::setDepth(std::size_t i, double Z, double sigma_Z) {
  const int id = static_cast<int>(i);
  const DepthPrior measured{Z, sigma_Z / (Z * Z)};
  if (features_[i].estimate_.status == DepthStatus::unset || !measured.isUsable()) return;
  estimator_->correctDepth(id, measured);
  features_[i].publishDepth(estimator_->estimate(id));
}

}  // namespace depthservo
