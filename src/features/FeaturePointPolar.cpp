#include "depthservo/features/FeaturePointPolar.h"

#include <algorithm>
#include <cmath>

#include "depthservo/visp/using.h"
#include "features/hasStatedDepth.h"

namespace depthservo {
namespace {

/// ViSP refuses rho below 1e-6, where theta says nothing.
constexpr double kSmallestRho = 2e-6;

}  // namespace

void FeaturePointPolar::follow(const Motion& motion) {
  ShownPoint point{get_rho() * std::cos(get_theta()), get_rho() * std::sin(get_theta()), get_Z(),
                   flags[0] && flags[1]};
  const ShownPoint before = point;
  point_.observe(motion, point);
  if (point.x != before.x || point.y != before.y) {
    set_rho(std::hypot(point.x, point.y));
    set_theta(std::atan2(point.y, point.x));
  }
  if (point.Z != get_Z()) set_Z(point.Z);
  if (!point_.isObserved()) return;
  if (std::abs(get_rho()) < kSmallestRho) set_rho(kSmallestRho);
  resetFlags();
}

void FeaturePointPolar::setDepth(double depth, double sigma_depth) {
  if (point_.setDepth(depth, sigma_depth)) set_Z(point_.servoDepth());
}

void FeaturePointPolar::meet(const vpBasicFeature& s_star) {
  const auto* desired = dynamic_cast<const vpFeaturePointPolar*>(&s_star);
  if (desired && hasStatedDepth(*desired)) point_.meetDesired(desired->get_Z());
}

}  // namespace depthservo
