#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "depthservo/sequence/Sequence.h"
#include "text/StrictYaml.h"

namespace depthservo::detail {

/// Keys of sequence.yaml.
const std::vector<std::string>& settingsKeys();

/// What of sequence.yaml says what is looked at, and how.
SequenceTarget targetOf(const StrictMapping& settings);

/// Pose of the camera on the hand of an arm, whose poses the ground truth has; the identity: they
/// are the camera's own.
Eigen::Isometry3d handEyeIn(const std::string& file);

}  // namespace depthservo::detail
