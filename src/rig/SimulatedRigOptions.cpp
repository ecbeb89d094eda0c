#include "depthservo/rig/SimulatedRigOptions.h"

namespace depthservo {

bool HiddenPeriod::covers(double time_s, int point) const {
  return time_s >= from && time_s < to &&
         (points.empty() || std::find(points.begin(), points.end(), point) != points.end());
}

double SensingOptions::assumedNoise_px() const {
  constexpr double kLeastNoise_px = 0.1;
  return assumed_noise.value_or(std::max(pixel_noise, kLeastNoise_px));
}

OdometryNoise OdometryOptions::declaredNoise() const {
  return noise.isZero() ? OdometryNoise::none() : OdometryNoise::white(noise[0], noise[1], mode);
}

}  // namespace depthservo
