#pragma once

#include <visp3/core/vpColVector.h>

#include "depthservo/motion/Twist.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

inline bool isTwist(const DEPTHSERVO_VISP vpColVector& v) { return v.size() == 6; }

/// \param v 6: (vx, vy, vz, wx, wy, wz)
inline Twist toTwist(const DEPTHSERVO_VISP vpColVector& v) {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

}  // namespace depthservo
