#pragma once

#include <string>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/target/AprilTagTarget.h"
#include "depthservo/tracking/TargetPose.h"

namespace depthservo {

/// Observed depth against the tag's own pose.
///
/// The pose of a tag of side 1 gives the depths D of its corners up to scale; the observed depths Z
/// then say how large the tag is, Z / D. Where the size is known both must agree: a wrong size, a
/// wrong scale of the odometry and a wrong focal length all show as a disagreement.
class TagSizeMonitor {
 public:
  TagSizeMonitor(const AprilTagTarget& target, const PinholeCamera& camera);

  /// Compares in an image. \param points corners measured in it, ids as in AprilTagTarget \return
  /// sentences for the user, when a tag's size turns out wrong
  std::vector<std::string> compare(const std::vector<TrackedPoint>& points,
                                   const PointSetEstimator& estimator);

  /// Depth of a corner by the pose of its tag in the last image [m]; kUnknown without size or pose.
  double depthByPose(int id) const;

  /// Of the tags whose size is given or was observed.
  std::vector<TagRecord> results() const;

 private:
  struct Tag {
    TargetPose pose;           // of a tag of side 1
    bool isSeen = false;       // in the last image, with a pose
    Eigen::Vector4d depths;    // of its corners for a side of 1
    double relativeSigma = 0;  // of these depths [-], 1 sigma
    int disagreements = 0;     // in a row
  };
  bool findPose(Tag& tag, std::size_t index, const std::vector<TrackedPoint>& points) const;

  PinholeCamera camera_;
  std::vector<Tag> tags_;
  std::vector<TagRecord> results_;
};

}  // namespace depthservo
