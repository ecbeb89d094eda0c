#pragma once

#include <visp3/visual_features/vpFeaturePointPolar.h>

#include "depthservo/api.h"
#include "depthservo/features/ObservingPointFeature.h"

namespace depthservo {

/// A vpFeaturePointPolar (rho, theta) that observes its own depth:
///
///     depthservo::FeaturePointPolar s[4];             // was: vpFeaturePointPolar s[4];
///     ...
///     vpFeatureBuilder::create(s[i], cam, dot[i]);    // unchanged
///     s[i].observe(v, dt);                            // new
///     v = task.computeControlLaw();                   // unchanged
///
/// All else is as for FeaturePoint. Once observed, rho stays above what ViSP refuses (1e-6).
class DEPTHSERVO_API FeaturePointPolar
    : public ObservingPointFeature<DEPTHSERVO_VISP vpFeaturePointPolar> {
 public:
  /// Fuses a depth measured now. \param Z, sigma_Z [m], > 0 \rtsafe
  void setDepth(double Z, double sigma_Z);

  FeaturePointPolar* duplicate() const override { return new FeaturePointPolar(*this); }

 protected:
  void follow(const Motion& motion) override;
  void meet(const DEPTHSERVO_VISP vpBasicFeature& s_star) override;
};

}  // namespace depthservo
