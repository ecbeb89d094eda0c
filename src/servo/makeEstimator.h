#pragma once

#include <memory>

#include "depthservo/depth/OdometryNoise.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/servo/Replay.h"
#include "depthservo/servo/Scenario.h"

namespace depthservo {

/// What an estimator is made from.
struct EstimatorSetup {
  Scenario::Depth depth;          ///< which one, its first guess and its range
  OdometryNoise odometry;         ///< as declared
  double odometryScaleSigma = 0;  ///< relative, 1 sigma
  DotTarget target;               ///< for `pose`
};

/// As a scenario asks for, or a replay. \throw InputError the sequence lacks what it needs
EstimatorSetup setupOf(const Scenario& scenario);
EstimatorSetup setupOf(const Sequence& sequence, const ReplayOptions& options);

/// The estimator a user chose, for up to `capacity` points. (`true` is a constant depth that is
/// told the truth in every frame.)
std::unique_ptr<PointSetEstimator> makeEstimator(const EstimatorSetup& setup, std::size_t capacity);

}  // namespace depthservo
