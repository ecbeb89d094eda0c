#include "depthservo/features/ObservingFeature.h"

#include "depthservo/visp/using.h"
#include "features/toTwist.h"

namespace depthservo::detail {

Motion motionOf(const vpColVector& twist, double dt) { return toMotion(twist, dt); }

void describeDepth(std::ostream& out, const DepthEstimate& estimate) {
  if (estimate.status == DepthStatus::unset) return;
  out << "Observed: Z=" << estimate.Z() << " sigma_Z=" << estimate.sigma_Z() << " ("
      << estimate.status << ")" << std::endl;
}

}  // namespace depthservo::detail
