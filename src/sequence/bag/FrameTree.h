#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "sequence/bag/messages.h"

namespace depthservo::detail {

/// Coordinate frames and where each stands in its parent, as tf tells them.
class FrameTree {
 public:
  struct Frame {
    std::string parent;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< in the parent
    bool isStill = true;                                     ///< always told alike
    bool hasOneParent = true;
  };

  void add(const TransformMessage& transform);

  /// Pose of a frame in another, through frames that stand still to each other. Throws BagFault:
  /// they are not connected, or one of those between moves.
  Eigen::Isometry3d poseOf(const std::string& frame, const std::string& reference) const;

  const std::map<std::string, Frame>& frames() const { return frames_; }  ///< by name

 private:
  std::vector<std::string> waysUp(const std::string& frame) const;

  std::map<std::string, Frame> frames_;
};

}  // namespace depthservo::detail
