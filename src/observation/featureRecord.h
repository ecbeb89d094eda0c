#pragma once

#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/tracking/PointTracker.h"
#include "observation/SelfDiagnosis.h"

namespace depthservo {

/// A point in an image: where it was found or, when it was not, where it is believed to be. What is
/// true of it is left to the caller.
/// \param points found in the image \param diagnosis for the forecast; may be null
FeatureRecord featureRecord(int id, const DepthEstimate& estimate,
                            const std::vector<TrackedPoint>& points, const PinholeCamera& camera,
                            const SelfDiagnosis* diagnosis);

}  // namespace depthservo
