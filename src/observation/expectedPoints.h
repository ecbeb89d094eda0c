#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// Where a tracker should look for the points in the image taken at this time [s]: predicted from
/// the estimates as far as the odometry reaches.
DEPTHSERVO_INNER std::vector<ExpectedPoint> expectedPoints(const PointSetEstimator& estimator,
                                                           const std::vector<int>& ids,
                                                           const MotionBuffer& odometry,
                                                           double time_s,
                                                           const PinholeCamera& camera);

}  // namespace depthservo
