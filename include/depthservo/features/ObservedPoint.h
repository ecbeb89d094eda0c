#pragma once

#include <visp3/core/vpCameraParameters.h>

#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/features/DepthBlend.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// A point as a ViSP feature holds it.
struct ShownPoint {
  double x = 0, y = 0, Z = 1;  ///< normalised; [m]
  bool isNew = false;          ///< x and y were measured since the last image
};

/// The depth that one image point of a feature needs: its estimator, what is told of it, and which
/// depth a task is given. FeaturePoint and its kin have one for each point.
///
/// Real-time: what is marked so does not allocate, throw, lock or print. What is shown is always
/// finite, with Z within the range. Copies are independent.
class DEPTHSERVO_API ObservedPoint {
 public:
  /// Observes with an InverseDepthFilter that considers the errors of ErrorProfile::arm().
  ObservedPoint();

  /// Observes with a copy of `estimator`. \param range depths that may be shown [m]
  explicit ObservedPoint(const DepthEstimator& estimator, const DepthRange& range = {});

  ObservedPoint(const ObservedPoint& other);
  ObservedPoint& operator=(const ObservedPoint& other);
  ~ObservedPoint() = default;

  /// As of FeaturePoint.
  void setErrors(const ErrorProfile& errors);
  void setNoise(double sigma_px, const DEPTHSERVO_VISP vpCameraParameters& cam);  ///< \rtsafe
  void setServoDepth(ServoDepth choice) { blend_.setChoice(choice); }             ///< \rtsafe

  void setDesiredDepth(double Z) { blend_.setDesired(Z); }  ///< \rtsafe
  void meetDesired(double Z) { blend_.meetDesired(Z); }     ///< \rtsafe
  double desiredDepth() const { return blend_.desired(); }  ///< 0 while unknown

  /// One image: the point goes with the motion and is corrected where it was measured; the depth in
  /// `shown`, if it is new, starts the depth anew. `shown` becomes what the task is to be given.
  /// \param motion as ToldMotion takes it; nothing happens where it has no duration
  /// \rtsafe
  void observe(const Motion& motion, ShownPoint& shown);

  /// Fuses a depth measured now. \return whether it was taken; `servoDepth` is then another
  /// \rtsafe
  bool setDepth(double Z, double sigma_Z);

  const DepthEstimate& estimate() const { return estimate_; }
  bool isObserved() const { return estimate_.status != DepthStatus::unset; }

  /// The depth that a task is given [m].
  double servoDepth() const { return blend_.of(estimate_); }

  /// This Z if ViSP can use it, else the last one that it could.
  double usable(double Z);

  unsigned depthsSet() const { return depthsSet_; }
  unsigned restarts() const { return restarts_; }

  /// Forgets the point, not what is known of the robot. \param Z the feature's default depth [m]
  void reset(double Z);

 private:
  friend class FeaturePointGroup;
  friend class PointFeatures;
  friend class FeaturePoint;

  bool takesNewDepth(double Z);
  void show(const DepthEstimate& estimate, ShownPoint& shown);
  double take(const DepthEstimate& estimate);  // the same, of the depth alone
  PointMeasurement measured(const ShownPoint& p) const { return {p.x, p.y, sigma_}; }
  void considerErrors();

  std::unique_ptr<DepthEstimator> estimator_;  // none in a group, which has one for all
  bool hasErrors_ = false;                     // it is an InverseDepthFilter that considers errors_
  ErrorProfile errors_;
  double focal_px_;
  DepthEstimate estimate_;
  double sigma_;          // image noise, normalised
  double Z_written_ = 1;  // by `show`; any other value was set by the user
  double Z_usable_ = 1;   // the last value that ViSP can use
  DepthBlend blend_;
  double Z_told_ = 1;  // the last depth that the user has set [m]
  bool wasDepthSet_ = false,
       isDepthSetAlways_ = false;  // before the last image; at images in a row
  unsigned depthsSet_ = 0, restarts_ = 0;
};

}  // namespace depthservo
