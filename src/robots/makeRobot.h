#pragma once

#include <memory>

#include "depthservo/robots/RobotOptions.h"
#include "depthservo/robots/SimulatedRobot.h"
#include "text/Names.h"

namespace depthservo {

const std::vector<detail::Choice<RobotKind>>& robotWords();

/// The robot of a scenario, at rest at a pose.
std::unique_ptr<SimulatedRobot> makeRobot(const RobotOptions& robot, const RobotPose& pose);

}  // namespace depthservo
