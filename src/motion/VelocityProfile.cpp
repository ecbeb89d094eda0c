#include "depthservo/motion/VelocityProfile.h"

#include <algorithm>
#include <cmath>

namespace depthservo {

Eigen::VectorXd velocityAt(const VelocityProfile& profile, double time_s, Eigen::Index size) {
  const auto segment =
      std::find_if(profile.begin(), profile.end(), [&](const auto& s) { return time_s < s.until; });
  Eigen::VectorXd velocity = Eigen::VectorXd::Zero(size);
  if (segment == profile.end()) return velocity;
  const auto entry = [](const Eigen::VectorXd& values, Eigen::Index i) {
    return i < values.size() ? values[i] : 0.0;
  };
  for (Eigen::Index i = 0; i < size; ++i) {
    velocity[i] = entry(segment->v, i) +
                  entry(segment->amplitude, i) *
                      std::sin(entry(segment->omega, i) * time_s + entry(segment->phase, i));
  }
  return velocity;
}

}  // namespace depthservo
