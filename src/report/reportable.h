#pragma once

#include <cmath>

#include "depthservo/depth/DepthEstimate.h"

namespace depthservo {

/// What may be written: an estimate without a usable depth says that nothing is known.
inline DepthEstimate reportable(const DepthEstimate& estimate) {
  const bool isUsable = estimate.chi > 0 && std::isfinite(estimate.Z()) &&
                        std::isfinite(estimate.sigma_Z()) && estimate.sigma_chi >= 0;
  if (isUsable) return estimate;
  DepthEstimate nothing;
  nothing.status = DepthStatus::lost;
  return nothing;
}

}  // namespace depthservo
