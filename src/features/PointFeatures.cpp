#include "depthservo/features/PointFeatures.h"

#include <algorithm>

#include "motion/median.h"

namespace depthservo {
namespace {

/// Whether an estimate has run to the near end of its range, however sure it seems: no point of
/// the static scene, or none whose depth can be seen from here.
bool isHeldAtNearEnd(const DepthEstimate& e, const DepthRange& range) {
  constexpr double kAtTheEnd = 0.99;  // a prediction to now may leave it a little
  return e.chi >= kAtTheEnd / range.Z_min;
}

}  // namespace

PointFeatures::PointFeatures(std::size_t count, const DepthRange& range) : features_(count) {
  estimates_.reserve(count);
  found_.reserve(count);
  for (FeaturePoint& feature : features_) {
    feature.point_.estimator_ = nullptr;
    feature.point_.blend_ = DepthBlend(range);
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
  estimates_.clear();
  found_.clear();
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const int id = static_cast<int>(i);
    const DepthEstimate& e = estimates_.emplace_back(
        isLate ? estimator.estimate(id, odometry, now_s) : estimator.estimate(id));
    const bool isFound = e.status != DepthStatus::unset && !e.isDoubtful();
    if (isFound && !isHeldAtNearEnd(e, estimator.range())) found_.push_back(e.Z());
  }
  const double Z_found = found_.empty() ? 0 : detail::medianOf(found_);
  const auto takesThatOfOthers = [&](const DepthEstimate& e) {
    return Z_found > 0 && isHeldAtNearEnd(e, estimator.range());
  };
  double caution = 1, Z_desiredSum = 0;
  int desired = 0;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const DepthEstimate& e = estimates_[i];
    if (e.status != DepthStatus::unset && !takesThatOfOthers(e)) {
      caution = std::max(caution, e.Z() / e.cautiousZ());
    }
    if (features_[i].point_.desiredDepth() > 0) {
      Z_desiredSum += features_[i].point_.desiredDepth();
      ++desired;
    }
  }
  for (std::size_t i = 0; i < features_.size(); ++i) {
    FeaturePoint& feature = features_[i];
    const DepthEstimate& e = estimates_[i];
    feature.point_.blend_.setGroup(desired > 0 ? Z_desiredSum / desired : 0, caution,
                                   takesThatOfOthers(e) ? Z_found : 0);
    if (isLate) feature.resetFlags();  // what was measured then is not where the point is now
    feature.publish(e);
  }
}

}  // namespace depthservo
