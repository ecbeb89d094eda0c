#include "depthservo/motion/UnknownMotion.h"

#include <algorithm>

namespace depthservo {
namespace {

/// Way within t [s] from a speed on, with this acceleration up to the limit.
double wayWithin(double t, double speed, double acceleration, double limit) {
  const double fastest = std::max(speed, limit);
  const double t_up = acceleration > 0 ? std::min(t, (fastest - speed) / acceleration) : 0;
  return (speed + 0.5 * acceleration * t_up) * t_up + fastest * (t - t_up);
}

}  // namespace

UnknownPart UnknownMotion::over(const Twist& last, double from_s, double to_s) const {
  const auto between = [&](double speed, double acceleration, double limit) {
    return wayWithin(to_s, speed, acceleration, limit) -
           wayWithin(from_s, speed, acceleration, limit);
  };
  return {
      to_s - from_s,
      between(last.linear.norm(), acceleration_mps2, std::min(speed_mps, Twist::kLargestSpeed_mps)),
      between(last.angular.norm(), turnAcceleration_rps2,
              std::min(turnRate_rps, Twist::kLargestTurnRate_rps))};
}

}  // namespace depthservo
