#pragma once

#include <memory>

#include "depthservo/robots/CameraRobot.h"
#include "depthservo/robots/RobotOptions.h"

namespace depthservo {

/// The robot of a scenario, at rest at a pose.
std::unique_ptr<CameraRobot> makeRobot(const RobotOptions& robot,
                                       const RobotPose& pose);

}  // namespace depthservo
