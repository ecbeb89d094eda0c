#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace depthservo {

/// Factor that brings every value within its limit: 1 or less.
template <typename Values, typename Limits>
double commonFactor(const Eigen::MatrixBase<Values>& values,
                    const Eigen::MatrixBase<Limits>& limits) {
  double factor = 1;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double size = std::abs(values[i]);
    if (size * factor > limits[i]) factor = limits[i] / size;
  }
  return factor;
}

/// Factor that brings velocities down to zero as fast as the decelerations allow within dt [s].
template <typename Values, typename Limits>
double brakingFactor(const Eigen::MatrixBase<Values>& velocities,
                     const Eigen::MatrixBase<Limits>& decelerations, double dt) {
  double stop_s = 0;
  for (Eigen::Index i = 0; i < velocities.size(); ++i) {
    stop_s = std::max(stop_s, std::abs(velocities[i]) / decelerations[i]);
  }
  return stop_s > dt ? 1 - dt / stop_s : 0;
}

}  // namespace depthservo
