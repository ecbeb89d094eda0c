#include "depthservo/features/ObservingFeature.h"

#include "depthservo/visp/using.h"
#include "features/toTwist.h"

namespace depthservo::detail {

Motion motionOf(const vpColVector& twist, double dt) { return toMotion(twist, dt); }

}  // namespace depthservo::detail
