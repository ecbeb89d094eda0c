#include "sequence/bag/FrameTree.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace depthservo::detail {
namespace {

constexpr std::size_t kMostFrames = 10000;

}  // namespace

void FrameTree::add(const TransformMessage& transform) {
  if (transform.child.empty() || transform.child == transform.header.frame) return;
  if (frames_.size() >= kMostFrames && frames_.count(transform.child) == 0) return;
  const auto [at, isNew] = frames_.try_emplace(transform.child);
  Frame& frame = at->second;
  if (isNew) {
    frame.parent = transform.header.frame;
    frame.pose = transform.pose;
  } else if (frame.parent != transform.header.frame) {
    frame.hasOneParent = false;
  } else if (frame.isStill) {
    constexpr double kRounding = 1e-9;  // m, and of a rotation
    frame.isStill =
        (frame.pose.matrix() - transform.pose.matrix()).cwiseAbs().maxCoeff() <= kRounding;
  }
}

/// The frame, its parent, and so on.
std::vector<std::string> FrameTree::waysUp(const std::string& frame) const {
  std::vector<std::string> up{frame};
  for (auto at = frames_.find(frame); at != frames_.end() && up.size() <= frames_.size();
       at = frames_.find(up.back())) {
    up.push_back(at->second.parent);
  }
  return up;
}

Eigen::Isometry3d FrameTree::poseOf(const std::string& frame, const std::string& reference) const {
  if (frame == reference) return Eigen::Isometry3d::Identity();
  const std::vector<std::string> up = waysUp(frame), referenceUp = waysUp(reference);
  const auto common =
      std::find_first_of(up.begin(), up.end(), referenceUp.begin(), referenceUp.end());
  if (common == up.end()) {
    std::vector<std::string> known;
    for (const auto& [name, at] : frames_) {
      if (known.size() < 12) known.push_back(fmt::format("{} in {}", name, at.parent));
    }
    throw BagFault(fmt::format(
        "no transforms lead from {} to {} ({})", reference, frame,
        known.empty() ? "the bag has none" : fmt::format("there are: {}", fmt::join(known, ", "))));
  }
  const auto poseIn = [&](const std::vector<std::string>& way) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (const std::string& name : way) {
      if (name == *common) break;
      const Frame& at = frames_.at(name);
      if (!at.hasOneParent) throw BagFault(fmt::format("the frame {} has two parents", name));
      if (!at.isStill) {
        throw BagFault(fmt::format("the frame {} moves in {}, so {} does not stand still in {}",
                                   name, at.parent, frame, reference));
      }
      pose = at.pose * pose;
    }
    return pose;
  };
  return poseIn(referenceUp).inverse() * poseIn(up);
}

}  // namespace depthservo::detail
