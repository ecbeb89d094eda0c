#pragma once

#include <visp3/core/vpCameraParameters.h>
#include <visp3/visual_features/vpFeatureLine.h>

#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/features/ObservedPlane.h"
#include "depthservo/features/ObservingShapeFeature.h"

namespace depthservo {

/// A vpFeatureLine (rho, theta) that observes the two parameters of depth that its interaction
/// matrix needs, the inverse depth at its foot (the point of the line nearest to the optical axis)
/// and the slope of the inverse depth along it:
///
///     depthservo::FeatureLine s;                    // was: vpFeatureLine s;
///     ...
///     vpFeatureBuilder::create(s, cam, meLine);     // unchanged
///     s.observe(v, dt);                             // new: sets A, B, C, D
///     v = task.computeControlLaw();                 // unchanged
///
/// No point of the line has to be told from another. A plane given by `setABCD` or `buildFrom`
/// before the first `observe` is the guess; ViSP lets nobody read one that vpFeatureBuilder or a
/// desired feature has: that guess is then 1 m, and Z* is told by `setDesiredDepth`. `estimate` is
/// the foot with its depth. All else is as for FeaturePoint.
class DEPTHSERVO_API FeatureLine : public ObservingShapeFeature<DEPTHSERVO_VISP vpFeatureLine> {
 public:
  FeatureLine();
  FeatureLine(const FeatureLine& other);
  FeatureLine& operator=(const FeatureLine& other);
  ~FeatureLine() override;

  /// As of FeaturePoint. `setErrors` starts the depth anew.
  void setErrors(const ErrorProfile& errors);

  /// Image noise, 1 sigma. Default 8e-4 [-] and 3e-3 rad: half a pixel at 600 px, over 200 px.
  void setNoise(double sigma_rho, double sigma_theta);

  /// Takes a plane that the line lies in, from points observed on it, say; instead of `observe`.
  /// One that is not `fitted`, and is not the camera's distance either, is ignored. \rtsafe
  void update(const ObservedPlane& plane);

  /// As ViSP's, and the guess. After the first `observe` a depth that differs by more than half
  /// from the one set before starts the depth anew; others have no effect.
  void setABCD(double A, double B, double C, double D);
  void buildFrom(double rho, double theta) { vpFeatureLine::buildFrom(rho, theta); }
  void buildFrom(double rho, double theta, double A, double B, double C, double D);

  double slope() const;        ///< of the inverse depth along the line, by (-sin, cos) [1/m]
  double sigma_slope() const;  ///< [1/m]

  FeatureLine* duplicate() const override { return new FeatureLine(*this); }

 protected:
  void follow(const Motion& motion) override;
  void forget() override;
  void describe(std::ostream& out) const override;

 private:
  struct Filter;

  void showPlane();

  std::unique_ptr<Filter> filter_;
  double sigma_rho_ = 8e-4, sigma_theta_ = 3e-3;
};

}  // namespace depthservo
