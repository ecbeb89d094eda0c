#pragma once

#include <vector>

#include "depthservo/pose/VisualMotionObserver.h"

namespace depthservo::detail {

/// A pose error that an image shows, g^^-1 g of a pose g^ that was assumed.
struct PoseStep {
  ImageVerdict verdict = ImageVerdict::accepted;
  Vector6d error = Vector6d::Zero();       // target axes
  Matrix6d covariance = Matrix6d::Zero();  // of the error, from pixel noise
  double residual = 0;                     // rms image error left, normalised
  Eigen::Isometry3d shown;                 // iterated only: the pose that the image shows
};

/// The pose of a known target by its points in one image. \rtsafe
class ImagePose {
 public:
  /// \param points of the target [m] \param seen where each is in the image; both must outlive this
  /// \param size of the target [m] \param Z_min nearest depth of a measured point [m]
  ImagePose(const std::vector<Eigen::Vector3d>& points, const std::vector<SeenPoint>& seen,
            double size, double Z_min);

  /// One step from this pose. \param method mixed or taylor
  PoseStep step(const Eigen::Isometry3d& cMo, ImageErrorMethod method) const;

  /// The mixed step from this pose, repeated until it no longer changes anything.
  PoseStep iterated(const Eigen::Isometry3d& cMo) const;

  /// Whether the remaining image errors are those of a pose, not of wrong points.
  bool explains(const PoseStep& step) const;

  /// A pose to start from: the target unturned, its seen points about where the image shows them.
  /// \param distance [m]; not nearer than twice the size: else points would be behind the camera
  Eigen::Isometry3d facing(double distance) const;

 private:
  const std::vector<Eigen::Vector3d>& points_;
  const std::vector<SeenPoint>& seen_;
  double count_;  // of seen points
  double size_, Z_min_;
};

/// One Newton step towards the nearest rotation: squares the rounding error.
inline void orthonormalise(Eigen::Isometry3d& g) {
  const Eigen::Matrix3d R = g.linear();
  g.linear() = 1.5 * R - 0.5 * R * (R.transpose() * R);
}

/// The derivative of gradient . (position of p in the camera) by the pose error: gradient in
/// target axes, p in the target.
inline Vector6d byPoseError(const Eigen::Vector3d& gradient, const Eigen::Vector3d& p) {
  Vector6d J;
  J << gradient, p.cross(gradient);
  return J;
}

}  // namespace depthservo::detail
