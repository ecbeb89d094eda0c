#include "depthservo/features/FeaturePointGroup.h"

#include "depthservo/visp/using.h"
#include "features/toTwist.h"

namespace depthservo {

FeaturePointGroup::FeaturePointGroup(const PointSetEstimator& estimator, std::size_t count)
    : PointFeatures(count, estimator.range()), estimator_(estimator.clone()) {
  estimator_->reset();
  observations_.reserve(count);
}

void FeaturePointGroup::observe(const vpColVector& twist, double dt) {
  observe(toMotion(twist, dt));
}

void FeaturePointGroup::observe(const Motion& told) {
  const Motion motion = motion_.take(told);
  for (FeaturePoint& feature : features_) feature.motion_ = motion_;
  if (!(motion.dt > 0)) {
    for (FeaturePoint& feature : features_) feature.publish(feature.estimate());
    return;
  }
  const bool isKnown = !motion.unknown.exists() && odometry_.push(clock_s_, motion.twist());
  if (!isKnown) odometry_.pushUnknown(clock_s_);
  clock_s_ += motion.dt;
  odometry_.holdUntil(clock_s_);
  observe(odometry_, clock_s_);
}

Coverage FeaturePointGroup::observe(const MotionBuffer& odometry, double time_s) {
  return observe(odometry, time_s, time_s);
}

Coverage FeaturePointGroup::observe(const MotionBuffer& odometry, double exposure_s, double now_s) {
  for (std::size_t i = 0; i < features_.size(); ++i) {
    FeaturePoint& feature = features_[i];
    const bool isFirst = feature.estimate().status == DepthStatus::unset;
    if (feature.point_.takesNewDepth(feature.get_Z()) || isFirst) {
      estimator_->setPrior(static_cast<int>(i), {feature.get_Z()});
    }
  }
  const Coverage coverage = estimator_->advance(odometry, exposure_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) {
    for (FeaturePoint& feature : features_) feature.publish(feature.estimate());
    return coverage;
  }
  observations_.clear();
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const ShownPoint shown = features_[i].shown();
    if (!shown.isNew) continue;
    observations_.push_back({static_cast<int>(i), features_[i].point_.measured(shown)});
  }
  estimator_->correct(observations_);
  publish(*estimator_, observations_, odometry, now_s);
  return coverage;
}

void FeaturePointGroup::setDepth(std::size_t i, double Z, double sigma_Z) {
  const int id = static_cast<int>(i);
  const DepthPrior measured{Z, sigma_Z / (Z * Z)};
  if (features_[i].estimate().status == DepthStatus::unset || !measured.isUsable()) return;
  estimator_->correctDepth(id, measured);
  features_[i].set_Z(features_[i].point_.take(estimator_->estimate(id)));
}

}  // namespace depthservo
