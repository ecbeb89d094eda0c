#pragma once

#include <string>

#include "depthservo/robots/RobotOptions.h"
#include "depthservo/servo/Safety.h"
#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

/// What `servo` must know of a robot: kind, camera mount, limits; when to stop it; how to steer it.
struct RobotFile {
  RobotOptions robot;
  SafetyOptions safety;
  ControlOptions control;
};

/// \throw InputError
RobotFile readRobotFile(const std::string& path);

}  // namespace depthservo
