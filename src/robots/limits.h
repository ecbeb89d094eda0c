#pragma once

#include <Eigen/Core>
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

}  // namespace depthservo
