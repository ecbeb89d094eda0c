#pragma once

#include <Eigen/Core>
#include <cmath>

namespace depthservo {

/// sin(a) / a, also near 0.
inline double sinc(double a) { return std::abs(a) < 1e-4 ? 1 - a * a / 6 : std::sin(a) / a; }

/// Way of a unicycle that starts at `heading` and drives `length` [m] while it turns by `turn`
/// [rad]: the chord of the arc, exact for any turn.
inline Eigen::Vector2d planarArc(double length, double turn, double heading) {
  const double middle = heading + 0.5 * turn;
  return length * sinc(0.5 * turn) * Eigen::Vector2d(std::cos(middle), std::sin(middle));
}

}  // namespace depthservo
