#pragma once

#include <visp3/visual_features/vpFeatureDepth.h>

#include "depthservo/api.h"
#include "depthservo/features/ObservingPointFeature.h"

namespace depthservo {

/// A vpFeatureDepth log(Z/Z*) that observes Z: with the x and y of a point a 2 1/2 D servo from
/// observed depth.
///
///     depthservo::FeatureDepth s;                          // was: vpFeatureDepth s;
///     s.buildFrom(x, y, guess, std::log(guess / Z_star));  // any guess
///     ...
///     s.set_x(x);                                          // the point in the image
///     s.set_y(y);
///     s.observe(v, dt);                                    // new: sets Z and log(Z/Z*)
///     v = task.computeControlLaw();                        // unchanged
///
/// Z* is what Z and log(Z/Z*), set together by `buildFrom` or `set_xyZLogZoverZstar`, say, or that
/// of `setDesiredDepth`. While it is unknown log(Z/Z*) keeps its value. All else is as for
/// FeaturePoint.
class DEPTHSERVO_API FeatureDepth : public ObservingPointFeature<DEPTHSERVO_VISP vpFeatureDepth> {
 public:
  /// Fuses a depth measured now. \param Z, sigma_Z [m], > 0 \rtsafe
  void setDepth(double Z, double sigma_Z);

  FeatureDepth* duplicate() const override { return new FeatureDepth(*this); }

 protected:
  void follow(const Motion& motion) override;

 private:
  void showDepth();
};

}  // namespace depthservo
