#pragma once

#include "depthservo/rig/SimulatedRigOptions.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// What the estimator of a simulated robot is told, but for the coupled goal, which takes a world.
EstimatorSetup simulatedSetup(const SimulatedRigOptions& rig, const EstimatorOptions& depth);

}  // namespace depthservo
