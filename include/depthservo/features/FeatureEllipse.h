#pragma once

#include <visp3/core/vpCameraParameters.h>
#include <visp3/visual_features/vpFeatureEllipse.h>

#include <Eigen/Core>
#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/features/ObservedPlane.h"
#include "depthservo/features/ObservingShapeFeature.h"

namespace depthservo {

/// What is seen as an ellipse.
enum class EllipseShape {
  planar,  ///< a circle or an ellipse in a plane, however tilted
  sphere   ///< the limb of a sphere, whose size nobody knows
};

/// A vpFeatureEllipse (x, y, n20, n11, n02) that observes the plane 1/Z = A x + B y + C of its
/// interaction matrix from how it moves and changes its form:
///
///     depthservo::FeatureEllipse s;                 // was: vpFeatureEllipse s;
///     ...
///     vpFeatureBuilder::create(s, cam, blob);       // unchanged
///     s.observe(v, dt);                             // new: sets A, B, C
///     v = task.computeControlLaw();                 // unchanged
///
/// A plane given by `setABC` or `buildFrom` before the first `observe` is the guess; ViSP lets
/// nobody read one that vpFeatureBuilder or a desired feature has: that guess is then 1 m, and Z*
/// is told by `setDesiredDepth`. The depth of `estimate` is that of the ellipse's centre, or of the
/// sphere's. All else is as for FeaturePoint.
class DEPTHSERVO_API FeatureEllipse
    : public ObservingShapeFeature<DEPTHSERVO_VISP vpFeatureEllipse> {
 public:
  explicit FeatureEllipse(EllipseShape shape = EllipseShape::planar);
  FeatureEllipse(const FeatureEllipse& other);
  FeatureEllipse& operator=(const FeatureEllipse& other);
  ~FeatureEllipse() override;

  /// As of FeaturePoint. `setErrors` starts the depth anew.
  void setErrors(const ErrorProfile& errors);

  /// Image noise of the centre, and of the semi-axes: 1 sigma [px], > 0. Default 8e-4 normalised.
  /// \rtsafe
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam);

  /// Takes the plane of observed points, instead of `observe`. \rtsafe
  void update(const ObservedPlane& plane);

  /// As ViSP's, and the guess. After the first `observe` a depth that differs by more than half
  /// from the one set before starts the depth anew; others have no effect.
  void setABC(double A, double B, double C);
  void buildFrom(double x, double y, double n20, double n11, double n02) {
    vpFeatureEllipse::buildFrom(x, y, n20, n11, n02);
  }
  void buildFrom(double x, double y, double n20, double n11, double n02, double A, double B,
                 double C);

  /// (A, B, C) as a task is given them [1/m].
  const Eigen::Vector3d& abc() const { return abc_; }

  FeatureEllipse* duplicate() const override { return new FeatureEllipse(*this); }

 protected:
  void follow(const Motion& motion) override;
  void forget() override;

 private:
  using Seen = Eigen::Matrix<double, 5, 1>;
  struct Filters;

  void step(const Motion& motion, const Seen& seen, bool isNew);
  Seen predicted() const;
  void showPlane();

  std::unique_ptr<Filters> filters_;
  EllipseShape shape_;
  Eigen::Vector3d abc_ = Eigen::Vector3d::UnitZ();
  double sigma_ = 8e-4;
};

}  // namespace depthservo
