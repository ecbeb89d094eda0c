#pragma once

#include <Eigen/Core>

namespace depthservo {

/// Velocities of a robot, n [m/s, rad/s], or their limits; never on the heap. A robot has at most
/// eight: an arm with six joints on a base with two wheels.
using Velocities = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 8, 1>;

}  // namespace depthservo
