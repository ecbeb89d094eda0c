#include "depthservo/target/TargetOptions.h"

namespace depthservo {

AprilTagTarget TargetOptions::trueTags() const {
  AprilTagTarget target{family, {}};
  for (const TagOptions& tag : tags) target.tags.push_back({tag.id, tag.size, tag.pose.isometry()});
  return target;
}

AprilTagTarget TargetOptions::assumedTags() const {
  AprilTagTarget target{family, {}};
  for (const TagOptions& tag : tags) {
    target.tags.push_back({tag.id, tag.assumed_size, tag.pose.isometry()});
  }
  return target;
}

DotTarget TargetOptions::dots() const {
  if (type == TargetKind::dots) return {points, radius};
  const AprilTagTarget known = assumedTags();
  return {known.hasSizes() ? known.corners() : std::vector<Eigen::Vector3d>(), 0};
}

}  // namespace depthservo
