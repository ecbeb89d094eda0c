#pragma once

#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/features/PointFeatures.h"

namespace depthservo {

/// Features whose depths are observed together by one PointSetEstimator: its points have the ids
/// 0..n-1, and feature i is the view of point i that vpServo sees.
///
///     FeaturePointGroup s(PointwiseEstimator(InverseDepthFilter(), 4), 4);
///     for (int i = 0; i < 4; ++i) task.addFeature(s[i], sd[i]);
///     ...
///     for (int i = 0; i < 4; ++i) vpFeatureBuilder::create(s[i], cam, dot[i]);
///     s.observe(v, dt);
///     v = task.computeControlLaw();
///
/// One `observe` per image; the features' own `observe` does nothing. All else is as for
/// FeaturePoint: `set_Z` on a feature is a guess, or starts that depth anew; a feature whose x and
/// y were not set is hidden. Must outlive the task, like ViSP's features. \rtsafe after
/// construction
class DEPTHSERVO_API FeaturePointGroup : public PointFeatures {
 public:
  /// \param estimator copied; with room for `count` points
  FeaturePointGroup(const PointSetEstimator& estimator, std::size_t count);
  FeaturePointGroup(const FeaturePointGroup&) = delete;  // a task keeps where the features are
  FeaturePointGroup& operator=(const FeaturePointGroup&) = delete;

  /// As FeaturePoint::observe, for all features. \rtsafe
  void observe(const DEPTHSERVO_VISP vpColVector& twist, double dt);
  void observe(const Motion& motion);

  /// The same with odometry at its own rate: moves to the image of time [s] and takes the points
  /// set since. When the odometry does not cover the interval the answer says so: where it is only
  /// late the features keep their estimates, where the motion will not be known (a hole, its end)
  /// they coast as after a refused twist, as the odometry's own bounds allow. \rtsafe
  Coverage observe(const MotionBuffer& odometry, double time_s);

  /// The same, but the features are handed to the servo as predicted to `now_s`, for images that
  /// arrive late.
  Coverage observe(const MotionBuffer& odometry, double exposure_s, double now_s);

  /// Fuses a depth of feature i measured at the time of the last image. \param Z, sigma_Z [m], > 0
  /// \rtsafe
  void setDepth(std::size_t i, double Z, double sigma_Z);

  /// How the camera may move while its motion is unknown, for the overloads without odometry.
  /// \rtsafe
  void setUnknownMotion(const UnknownMotion& bounds) { odometry_.setBounds(bounds); }

  /// As of FeaturePoint, for the overloads without odometry.
  unsigned refused() const { return motion_.refused(); }
  double unknownFor_s() const { return motion_.unknownFor_s(); }

  const PointSetEstimator& estimator() const { return *estimator_; }

 private:
  std::unique_ptr<PointSetEstimator> estimator_;
  std::vector<PointObservation> observations_;
  MotionBuffer odometry_;  // of the overloads without one
  ToldMotion motion_;      // likewise
  double clock_s_ = 0;
};

}  // namespace depthservo
