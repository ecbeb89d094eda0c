#pragma once

#include <visp3/core/vpCameraParameters.h>
#include <visp3/visual_features/vpFeaturePoint.h>

#include "depthservo/features/ObservedPoint.h"
#include "depthservo/motion/ToldMotion.h"
#include "depthservo/visp/visp.h"

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
class FeaturePoint : public DEPTHSERVO_VISP vpFeaturePoint {
 public:
  /// Observes with an InverseDepthFilter that considers the errors of ErrorProfile::arm(): precise
  /// joints, a camera mounted by hand. For other robots see `setErrors`.
  FeaturePoint() = default;

  /// Observes with a copy of `estimator`. \param range depths that may reach ViSP [m]
  explicit FeaturePoint(const DepthEstimator& estimator, const DepthRange& range = {});

  FeaturePoint(const FeaturePoint& other);
  FeaturePoint& operator=(const FeaturePoint& other);
  ~FeaturePoint() override = default;

  /// What errs on this robot, and so what sigma contains: ErrorProfile::typical() for wheels and a
  /// gyro, ErrorProfile() for a perfect robot. Replaces the estimator; call it before the first
  /// `observe`, later calls start the depth anew at the estimate.
  void setErrors(const ErrorProfile& errors) { point_.setErrors(errors); }

  /// Takes the camera twist (6: vx vy vz wx wy wz [m/s, rad/s], camera frame) that was applied for
  /// dt [s] since the previous image, and the x and y set since then. A twist of another size, a
  /// value that is not finite or dt <= 0 is counted (`refused`): the motion of that time (of the
  /// last dt that could be used) is unknown. The depth coasts with a sigma that grows as
  /// `setUnknownMotion` allows, measured or not, and measurements say where the point is, nothing
  /// of its depth. \rtsafe
  void observe(const DEPTHSERVO_VISP vpColVector& twist, double dt);

  /// The same from the motion itself. \rtsafe
  void observe(const Motion& motion);

  /// Fuses a depth measured now, e.g. by a range sensor. \param Z, sigma_Z [m], > 0 \rtsafe
  void setDepth(double Z, double sigma_Z);

  /// The depth at the goal, Z* [m]. While the observed depth is vague the servo uses a blend of
  /// both, weighted by their variances (that of the desired one being 0.7/Z); `estimate()` is never
  /// blended. Without this call the depth of the desired feature met in `error` serves, if it was
  /// set: ViSP's default of 1 m says nothing. \rtsafe
  void setDesiredDepth(double depth) { point_.setDesiredDepth(depth); }

  /// What the servo is given while the observed depth is vague. `blended` (default): while
  /// `DepthEstimate::isDoubtful` no depth beyond the larger of Z* and the near end of the interval;
  /// without Z* the near end alone. Doubt slows the robot down, never up. `observed`: the estimate
  /// as it is. \rtsafe
  void setServoDepth(ServoDepth choice) { point_.setServoDepth(choice); }

  /// How the camera may move while its motion is unknown. \rtsafe
  void setUnknownMotion(const UnknownMotion& bounds) { motion_.setBounds(bounds); }

  /// Image noise: standard deviation per axis [px], > 0. Default 8e-4 normalised (0.5 px at 600
  /// px). \rtsafe
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam) {
    point_.setNoise(sigma_px, cam);
  }

  /// The point and its depth at the last `observe`; status `unset` before the first.
  const DepthEstimate& estimate() const { return point_.estimate(); }

  /// True when the task computes errors with this feature without ever asking for its interaction
  /// matrix, as vpServo does in its default mode DESIRED and in USER_DEFINED: the observed depth is
  /// then not used.
  bool depthUnused() const { return depthUnused_; }

  /// Calls of `observe` whose twist or dt could not be used.
  unsigned refused() const { return motion_.refused(); }

  /// For how long, up to the last `observe`, the twists could not be used [s]; 0 while they can.
  double unknownFor_s() const { return motion_.unknownFor_s(); }

  /// Images since the first `observe` before which a depth was set, and those of them that started
  /// the depth anew.
  unsigned depthsSet() const { return point_.depthsSet(); }
  unsigned restarts() const { return point_.restarts(); }

  void init() override;
  FeaturePoint* duplicate() const override;
  DEPTHSERVO_VISP vpMatrix interaction(unsigned int select = FEATURE_ALL) override;
  DEPTHSERVO_VISP vpColVector error(const DEPTHSERVO_VISP vpBasicFeature& s_star,
                                    unsigned int select = FEATURE_ALL) override;
  void print(unsigned int select = FEATURE_ALL) const override;
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<unsigned char>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;

 private:
  friend class FeaturePointGroup;
  friend class PointFeatures;

  /// What the user has set since the last `observe`.
  ShownPoint shown() const { return {get_x(), get_y(), get_Z(), flags[0] && flags[1]}; }

  /// Hands a point to ViSP and forgets what was set.
  void show(const ShownPoint& point);
  void publish(const DepthEstimate& estimate);  // of a group

  ObservedPoint point_;
  bool interactionAsked_ = false, depthUnused_ = false;
  ToldMotion motion_;
};

}  // namespace depthservo
