#pragma once

#include <Eigen/Core>
#include <vector>

namespace depthservo {

/// Round dots: a flat plate in the plane z = 0 of the object frame (seen from the front: x right, y
/// down, z away), or dots anywhere, which only start positions can tell apart. The index is the id.
struct DotTarget {
  std::vector<Eigen::Vector3d> points;  ///< centres, object frame [m]
  double radius = 0;                    ///< [m]; 0 when unknown
};

}  // namespace depthservo
