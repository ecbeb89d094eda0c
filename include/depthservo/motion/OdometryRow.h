#pragma once

#include "depthservo/motion/Twist.h"

namespace depthservo {

/// What the twist of a row of odometry is.
enum class RowMeaning {
  hold,        ///< the mean from this row's time to the next row's
  instant,     ///< a sample, taken at the row's time
  meanBefore,  ///< the mean from the row before to this one, as encoders tell it
};

/// A row of odometry.
struct OdometryRow {
  double time_s = 0;
  Twist twist;
};

}  // namespace depthservo
