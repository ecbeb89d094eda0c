#pragma once

#include <memory>

#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/servo/Scenario.h"

namespace depthservo {

/// The estimator a user chose, for up to `capacity` points. (`true` is a constant depth that is
/// told the truth in every frame.)
std::unique_ptr<PointSetEstimator> makeEstimator(const Scenario::Depth& depth,
                                                 const Eigen::Vector2d& odometryNoise,
                                                 std::size_t capacity);

}  // namespace depthservo
