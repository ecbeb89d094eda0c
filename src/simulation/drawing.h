#pragma once

#include <algorithm>
#include <cmath>

#include "depthservo/motion/Motion.h"
#include "depthservo/simulation/SyntheticCamera.h"

namespace depthservo::detail {

/// Half-open range of pixels.
struct PixelBox {
  int left = 0, top = 0, right = 0, bottom = 0;

  int width() const { return right - left; }
  int height() const { return bottom - top; }
  bool isEmpty() const { return left >= right || top >= bottom; }
};

/// The part of a range that lies in the image.
inline PixelBox intersect(double left, double top, double right, double bottom,
                          const PinholeCamera& camera) {
  const auto cut = [](double x, int size) {
    return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(size)));
  };
  return {cut(left, camera.width), cut(top, camera.height), cut(right, camera.width),
          cut(bottom, camera.height)};
}

/// The pixels of the image that a figure between these corners [px] touches.
inline PixelBox touched(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                        const PinholeCamera& camera) {
  return intersect(std::floor(low.x()), std::floor(low.y()), std::ceil(high.x()) + 1,
                   std::ceil(high.y()) + 1, camera);
}

/// Instants per pixel of motion blur, and the most for one figure.
constexpr double kInstantsPerPixel = 2;
constexpr int kMostInstants = 128;

/// Instants at which a figure is drawn that moves this far during the exposure [px].
inline int instantsOver(double path_px) {
  return static_cast<int>(
      std::min<double>(kMostInstants, 1 + std::ceil(kInstantsPerPixel * path_px)));
}

/// The camera moved on by a part of the exposure, -1/2..1/2.
inline Eigen::Isometry3d during(const SyntheticView& view, double exposure_s, double part) {
  const Motion motion = Motion::fromTwist(view.twist, part * exposure_s);
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.linear() = motion.R;
  moved.translation() = motion.t;
  return moved;
}

}  // namespace depthservo::detail
