#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// Pose of a known plate in the camera, from the dots seen in one image (OpenCV: closed-form start,
/// then virtual visual servoing, which minimises the reprojection error from the previous pose on).
class DEPTHSERVO_API TargetPose {
 public:
  TargetPose(const DotTarget& target, const PinholeCamera& camera)
      : target_(target), camera_(camera) {}

  struct Result {
    Eigen::Isometry3d cMo;  ///< plate in the camera
    double residual_px;     ///< rms distance of the dots to their reprojections [px]
  };
  /// Empty with fewer than four dots of the plate, or when no pose with all dots in front of the
  /// camera is found. Never throws.
  std::optional<Result> compute(const std::vector<TrackedPoint>& points);

 private:
  DotTarget target_;
  PinholeCamera camera_;
  std::optional<Eigen::Isometry3d> previous_;
};

}  // namespace depthservo
