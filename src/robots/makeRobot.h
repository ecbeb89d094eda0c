#pragma once

#include <memory>

#include "depthservo/api.h"
#include "depthservo/robots/RobotOptions.h"
#include "depthservo/robots/SimulatedRobot.h"
#include "text/Names.h"

namespace depthservo {

DEPTHSERVO_INNER const std::vector<detail::Choice<RobotKind>>& robotWords();

/// The robot of a scenario, at rest at a pose.
DEPTHSERVO_INNER std::unique_ptr<SimulatedRobot> makeRobot(const RobotOptions& robot,
                                                           const RobotPose& pose);

}  // namespace depthservo
