#include "depthservo/target/TargetOptions.h"

#include <fmt/format.h>

namespace depthservo {
namespace {

using Refuse = std::function<void(const std::string& key, const std::string& why)>;

void checkTags(const TargetOptions& target, const Refuse& refuse) {
  if (target.points != target.trueTags().corners()) {
    refuse("points", "is for dots; a tag's points are its corners");
  }
  const std::size_t most = kMostTargetPoints / 4;
  if (target.tags.empty() || target.tags.size() > most) {
    refuse("tags", fmt::format("expected 1 to {} tags, got {}", most, target.tags.size()));
  }
  const int count = aprilTagCount(target.family);
  for (std::size_t i = 0; i < target.tags.size(); ++i) {
    const int id = target.tags[i].id;
    if (id >= count) {
      refuse("tags", fmt::format("the family {} has the ids 0 to {}, not {}", target.family,
                                 count - 1, id));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (target.tags[j].id == id) refuse("tags", fmt::format("tag {} is there twice", id));
    }
  }
}

}  // namespace

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

void check(const TargetOptions& target, const Refuse& refuse) {
  if (target.type == TargetKind::apriltag) checkTags(target, refuse);
  const auto& points = target.points;
  if (points.empty() || points.size() > kMostTargetPoints) {
    refuse("points",
           fmt::format("expected 1 to {} points, got {}", kMostTargetPoints, points.size()));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (points[i] == points[j]) {
        refuse("points", fmt::format("points {} and {} are the same; remove one", j, i));
      }
    }
  }
  const std::string why = objection(target.twist, 6);
  if (!why.empty()) refuse("twist", why);
}

}  // namespace depthservo
