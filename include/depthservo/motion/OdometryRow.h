#pragma once

#include "depthservo/motion/Twist.h"

namespace depthservo {

/// A row of odometry: from this time on the camera moves with this twist, until the next row's
/// time.
struct OdometryRow {
  double time_s = 0;
  Twist twist;
};

}  // namespace depthservo
