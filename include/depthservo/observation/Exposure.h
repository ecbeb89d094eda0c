#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "depthservo/sequence/DepthMap.h"
#include "depthservo/tracking/PointTracker.h"
#include "depthservo/visp/GrayImage.h"

namespace depthservo {

/// What is true of a point at an instant, as far as it is known.
struct TruePoint {
  int id = 0;
  double Z = std::numeric_limits<double>::quiet_NaN();  ///< depth of its centre [m]
  /// Where a perfect tracker finds it [px]; NaN behind the camera, and where nobody knows.
  double u = std::numeric_limits<double>::quiet_NaN(), v = u;
};

/// An image, or points measured elsewhere, and when it was taken.
struct Exposure {
  double time_s = 0;                        ///< as stamped
  GrayImage image{};                        ///< of size 0: there is none
  std::vector<TrackedPoint> points{};       ///< where there is no image
  bool isMotionKnown = true;                ///< false: nothing is learnt from it
  std::vector<TruePoint> truth{};           ///< empty where it is not known
  std::shared_ptr<const DepthMap> depth{};  ///< true depths by place; null: not known
  std::optional<Eigen::Isometry3d> wMc{};   ///< true pose of the camera in the world

  bool hasImage() const { return image.getSize() > 0; }
};

}  // namespace depthservo
