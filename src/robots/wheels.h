#pragma once

#include <Eigen/Core>

namespace depthservo {

/// Speeds of the left and the right wheel of a unicycle [m/s]. \param velocity (v, w)
inline Eigen::Vector2d wheelSpeeds(const Eigen::Vector2d& velocity, double wheelBase) {
  const double turn = 0.5 * velocity[1] * wheelBase;
  return {velocity[0] - turn, velocity[0] + turn};
}

/// (v, w) of a unicycle by the speeds of its wheels: the inverse of wheelSpeeds.
inline Eigen::Vector2d robotVelocity(const Eigen::Vector2d& wheels, double wheelBase) {
  return {0.5 * (wheels[0] + wheels[1]), (wheels[1] - wheels[0]) / wheelBase};
}

/// Ways of the wheels [m] as encoders of this resolution [m] count them.
inline Eigen::Vector2d countedWay(const Eigen::Vector2d& way, double tick) {
  return (way / tick).array().floor() * tick;
}

}  // namespace depthservo
