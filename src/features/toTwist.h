#pragma once

#include <visp3/core/vpColVector.h>

#include <limits>

#include "depthservo/motion/Motion.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

inline bool isTwist(const DEPTHSERVO_VISP vpColVector& v) { return v.size() == 6; }

/// \param v 6: (vx, vy, vz, wx, wy, wz)
inline Twist toTwist(const DEPTHSERVO_VISP vpColVector& v) {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

/// \param dt [s] \return a motion that is not usable, but has this duration, where `v` is no usable twist
inline Motion toMotion(const DEPTHSERVO_VISP vpColVector& v, double dt) {
  if (isTwist(v) && dt > 0 && toTwist(v).isUsable()) return Motion::fromTwist(toTwist(v), dt);
  Motion unusable;
  unusable.dt = dt;
  unusable.t.setConstant(std::numeric_limits<double>::quiet_NaN());
  return unusable;
}

}  // namespace depthservo
