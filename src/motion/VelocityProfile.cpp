#include "depthservo/motion/VelocityProfile.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace depthservo {

Velocities velocityAt(const VelocityProfile& profile, double time_s, Eigen::Index size) {
  const auto segment =
      std::find_if(profile.begin(), profile.end(), [&](const auto& s) { return time_s < s.until; });
  Velocities velocity = Velocities::Zero(size);
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

std::string objection(const VelocityProfile& profile, std::size_t size) {
  std::ostringstream why;
  double until = 0;
  for (const VelocitySegment& segment : profile) {
    if (!(segment.until > until)) {
      why << "until = " << segment.until << " s comes after " << until << " s; times must increase";
      return why.str();
    }
    until = segment.until;
    for (const auto& [key, values] : {std::pair{"v", &segment.v},
                                      {"amplitude", &segment.amplitude},
                                      {"omega", &segment.omega},
                                      {"phase", &segment.phase}}) {
      if (values->size() == 0 || values->size() == static_cast<Eigen::Index>(size)) continue;
      why << key << ": expected " << size << " numbers, got " << values->size();
      return why.str();
    }
  }
  return "";
}

}  // namespace depthservo
