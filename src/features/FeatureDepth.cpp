#include "depthservo/features/FeatureDepth.h"

#include <cmath>

#include "depthservo/visp/using.h"

namespace depthservo {

void FeatureDepth::follow(const Motion& motion) {
  if (flags[2]) point_.meetDesired(get_Z() / std::exp(get_LogZoverZstar()));
  ShownPoint point{get_x(), get_y(), get_Z(), flags[0] && flags[1]};
  const ShownPoint before = point;
  point_.observe(motion, point);
  if (point.x != before.x || point.y != before.y) {
    set_x(point.x);
    set_y(point.y);
  }
  if (point.Z != get_Z()) set_Z(point.Z);
  if (!point_.isObserved()) return;
  showDepth();
  resetFlags();
}

void FeatureDepth::showDepth() {
  if (point_.desiredDepth() > 0) {
    set_LogZoverZstar(std::log(point_.servoDepth() / point_.desiredDepth()));
  } else if (!std::isfinite(get_LogZoverZstar())) {
    set_LogZoverZstar(0);
  }
}

void FeatureDepth::setDepth(double depth, double sigma_depth) {
  if (!point_.setDepth(depth, sigma_depth)) return;
  set_Z(point_.servoDepth());
  showDepth();
}

}  // namespace depthservo
