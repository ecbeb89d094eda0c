#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "depthservo/api.h"

namespace depthservo {

/// A flat rectangle of gray cells in a scene: a tag, a textured wall.
///
/// Patch frame: origin in the middle, x right along the columns, y down along the rows, z away from
/// the viewer who sees its front.
struct DEPTHSERVO_API GrayPatch {
  Eigen::Isometry3d oMp = Eigen::Isometry3d::Identity();  ///< patch in the object frame
  double width = 0, height = 0;                           ///< [m], > 0
  int columns = 0, rows = 0;                              ///< cells, >= 1
  std::vector<unsigned char> gray;                        ///< of the cells, row-major

  /// A wall with every cell of a gray level of its own, equally likely between `dark` and `light`.
  static GrayPatch random(double width, double height, int columns, int rows, std::uint64_t seed,
                          unsigned char dark = 30, unsigned char light = 220);
};

}  // namespace depthservo
