#pragma once

#include <Eigen/Core>
#include <vector>

namespace depthservo {

/// A flat plate with round dots, all in the plane z = 0 of the object frame (seen from the front: x
/// right, y down, z away from the viewer). The index of a point is its id.
struct DotTarget {
  std::vector<Eigen::Vector3d> points;  ///< centres, object frame [m]
  double radius = 0;                    ///< [m]; 0 when unknown
};

}  // namespace depthservo
