#pragma once

#include <visp3/core/vpCameraParameters.h>
#include <visp3/visual_features/vpFeaturePoint.h>

#include "depthservo/api.h"
#include "depthservo/features/ObservingPointFeature.h"

namespace depthservo {

/// A vpFeaturePoint that observes its own depth. In an existing ViSP loop the type changes and one
/// line is new:
///
///     depthservo::FeaturePoint s[4];                  // was: vpFeaturePoint s[4];
///     ...
///     vpFeatureBuilder::create(s[i], cam, dot[i]);    // unchanged
///     s[i].observe(v, dt);                            // new: twist since the previous image
///     v = task.computeControlLaw();                   // unchanged; uses the observed depth
///
/// The twist is the camera's own, in the camera frame, as really applied (after saturation); zero
/// for the first image. Joint robots: `cameraTwist(cVe, eJe, qdot)`. The target stands still. Until
/// the first `observe` everything is exactly as with vpFeaturePoint.
///
/// `set_Z` before the first `observe` is the guess; any guess will do. `set_Z` after it starts the
/// depth anew there, if it is new: the Z that was set last, set again (`buildFrom(x, y, Z)` at
/// every image), is not. Where Z is set at image after image (`vpFeatureBuilder::create` from a
/// vpPoint), only one that differs from the one before by more than half counts as new; the others
/// are counted (`depthsSet`) and have no effect. What such a Z is worth `setDepth` can be told.
/// `observe` without a new x and y predicts: the point is hidden, and (x, y)
/// moves to where it must be, so that the servo goes on; likewise when the measurement is rejected.
///
/// The task must use the features' own interaction matrix:
/// `task.setInteractionMatrixType(vpServo::CURRENT)` or MEAN. ViSP's default, DESIRED, never reads
/// it: `depthUnused()` tells. Declare features before the task, as with ViSP's own.
///
/// Real-time: `observe` does not allocate, throw, lock or print. What reaches ViSP is always
/// finite, with Z within the range. One thread per object; copies are independent.
///
/// Z* is that of `setDesiredDepth`, else of the desired feature met in `error`, if it was set
/// there: ViSP's default of 1 m says nothing.
class DEPTHSERVO_API FeaturePoint : public ObservingPointFeature<DEPTHSERVO_VISP vpFeaturePoint> {
 public:
  /// Observes with an InverseDepthFilter that considers the errors of ErrorProfile::arm(): precise
  /// joints, a camera mounted by hand. For other robots see `setErrors`.
  FeaturePoint() = default;

  /// Observes with a copy of `estimator`. \param range depths that may reach ViSP [m]
  explicit FeaturePoint(const DepthEstimator& estimator, const DepthRange& range = {});

  /// Fuses a depth measured now, e.g. by a range sensor. \param Z, sigma_Z [m], > 0 \rtsafe
  void setDepth(double Z, double sigma_Z);

  /// Images since the first `observe` before which a depth was set, and those of them that started
  /// the depth anew.
  unsigned depthsSet() const { return point_.depthsSet(); }
  unsigned restarts() const { return point_.restarts(); }

  FeaturePoint* duplicate() const override { return new FeaturePoint(*this); }
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<unsigned char>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;

 protected:
  void follow(const Motion& motion) override;
  void meet(const DEPTHSERVO_VISP vpBasicFeature& s_star) override;
  void describe(std::ostream& out) const override;

 private:
  friend class FeaturePointGroup;
  friend class PointFeatures;

  /// What the user has set since the last `observe`.
  ShownPoint shown() const { return {get_x(), get_y(), get_Z(), flags[0] && flags[1]}; }

  /// Hands a point to ViSP and forgets what was set.
  void show(const ShownPoint& point);
  void publish(const DepthEstimate& estimate);  // of a group
};

}  // namespace depthservo
