#pragma once

#include <memory>

#include "depthservo/robots/CameraRobot.h"
#include "depthservo/scenario/Scenario.h"

namespace depthservo {

/// The robot of a scenario, at rest at a pose.
std::unique_ptr<CameraRobot> makeRobot(const Scenario::Robot& robot,
                                       const Scenario::RobotPose& pose);

}  // namespace depthservo
