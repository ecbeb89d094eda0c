#pragma once

#include <visp3/visual_features/vpFeatureSegment.h>

#include <array>

#include "depthservo/api.h"
#include "depthservo/features/ObservedPoint.h"
#include "depthservo/features/ObservingFeature.h"

namespace depthservo {

/// A vpFeatureSegment, normalised or not, that observes the depths of its two ends:
///
///     depthservo::FeatureSegment s;                       // was: vpFeatureSegment s;
///     ...
///     vpFeatureBuilder::create(s, cam, end1, end2);       // unchanged
///     s.observe(v, dt);                                   // new: sets Z1 and Z2
///     v = task.computeControlLaw();                       // unchanged
///
/// `setZ1` and `setZ2` before the first `observe` are the guesses. All else is as for FeaturePoint.
class DEPTHSERVO_API FeatureSegment : public ObservingFeature<DEPTHSERVO_VISP vpFeatureSegment> {
 public:
  explicit FeatureSegment(bool normalized = false) { setNormalized(normalized); }

  /// As of FeaturePoint, for both ends.
  void setErrors(const ErrorProfile& errors);
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam);
  void setServoDepth(ServoDepth choice);
  void setDesiredDepths(double Z1, double Z2);

  /// \param i 0: the end with Z1, 1: that with Z2
  const DepthEstimate& estimate(std::size_t i) const { return ends_[i].estimate(); }

  FeatureSegment* duplicate() const override { return new FeatureSegment(*this); }

 protected:
  void follow(const Motion& motion) override;
  void forget() override;
  void makeUsable() override;
  void meet(const DEPTHSERVO_VISP vpBasicFeature& s_star) override;
  void describe(std::ostream& out) const override;

 private:
  void showDepths(double Z1, double Z2);

  std::array<ObservedPoint, 2> ends_;
};

}  // namespace depthservo
