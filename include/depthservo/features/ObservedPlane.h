#pragma once

#include <visp3/visual_features/vpFeatureMomentDatabase.h>

#include <Eigen/Core>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/features/PointFeatures.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// What a plane rests on.
enum class PlaneStatus {
  unset,           ///< no points yet
  fitted,          ///< the plane through the points at their depths
  frontoParallel,  ///< they do not determine one (nearly collinear, or depths that put a point
                   ///< behind the camera): the plane at their mean depth, facing the camera
  unusable,        ///< points that all coincide, or not finite: the plane before is kept
};
DEPTHSERVO_API const char* toString(PlaneStatus status);

/// The plane of observed points, in the camera frame and in ViSP's convention
///
///     1/Z = A x + B y + C,       x, y normalised,  A, B, C in 1/m:
///
/// what the interaction matrices of moments, ellipses, lines and luminance need (Chaumette, "Image
/// moments", IEEE T-RO 2004). Weighted total least squares: the residual of a point counts by
/// 1/(sigma_chi^2 + (A^2 + B^2) sigma_xy^2), so that errors of the image count as well as those of
/// the depth.
///
///     FeaturePointGroup points(ObjectDepthObserver(4), 4);
///     ObservedPlane plane;
///     ...
///     points.observe(v, dt);                 // after their x and y were set
///     plane.update(points);
///     plane.applyTo(features);               // was: features.updateAll(A, B, C)
///
/// Real-time: `update`, `buildFrom` and `predict` do not allocate, throw, lock or print; whatever
/// the points, A, B and C are finite.
class DEPTHSERVO_API ObservedPlane {
 public:
  /// From the points of a group as its last `observe` left them, at the depths that a task is given
  /// (FeaturePoint::setServoDepth). Before their first `observe`: as set by the user. \rtsafe
  void update(const PointFeatures& points);

  /// From estimates as they are, however vague. \rtsafe
  void update(const std::vector<DepthEstimate>& points);

  /// From points whose depths are known equally well, e.g. those at the goal; of the covariance
  /// only the shape then says anything. \rtsafe
  void buildFrom(const std::vector<PointState>& points);

  /// Follows the camera past the plane, while its points are not seen. \rtsafe
  void predict(const Motion& motion);

  /// Whether there is a plane, or at least its distance.
  bool isKnown() const {
    return status_ == PlaneStatus::fitted || status_ == PlaneStatus::frontoParallel;
  }
  PlaneStatus status() const { return status_; }

  /// (A, B, C) [1/m]; (0, 0, 1) before the first points.
  const Eigen::Vector3d& abc() const { return abc_; }

  /// Of (A, B, C) [1/m^2]. Of a plane that only faces the camera the variances of A and B are those
  /// of any tilt up to 45 degrees at 1 sigma.
  const Eigen::Matrix3d& covariance() const { return covariance_; }

  /// Inverse depth where the plane is seen at (x, y) [1/m], and its 1-sigma.
  double chiAt(double x, double y) const { return abc_.dot(Eigen::Vector3d(x, y, 1)); }
  double sigma_chiAt(double x, double y) const;

  /// Updates every moment feature of ViSP's in a database, in the order of their dependence (Basic,
  /// GravityCenter, Centered, Area, AreaNormalized, GravityCenterNormalized, CInvariant, Alpha):
  /// ViSP's own `updateAll` runs them in parallel and crashes. Moments must be up to date. What
  /// ViSP does in it allocates, and throws where a moment that it needs is not in the database. A
  /// feature that is not ViSP's is not found: update it oneself.
  /// \return how many there are
  int applyTo(DEPTHSERVO_VISP vpFeatureMomentDatabase& features) const;

 private:
  friend class FeatureMoments;
  struct Sample {
    double x, y, chi, sigma_chi, sigma_xy;
  };
  static Sample sampleOf(const FeaturePoint& point);
  static Sample sampleOf(const DepthEstimate& point);
  static Sample sampleOf(const PointState& point);

  /// \param sampleAt (i) of the points 0..count-1
  template <typename SampleAt>
  void fit(std::size_t count, const SampleAt& sampleAt);

  Eigen::Vector3d abc_ = Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Identity();
  PlaneStatus status_ = PlaneStatus::unset;
};

}  // namespace depthservo
