#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace depthservo {

/// Where the task is done.
struct ServoGoal {
  std::vector<Eigen::Vector2d> pixels;    ///< by point [px]
  std::vector<double> Z;                  ///< by point [m]; the first guess where unknown
  std::optional<Eigen::Isometry3d> cdMo;  ///< pose of the target in the camera, when known
};

}  // namespace depthservo
