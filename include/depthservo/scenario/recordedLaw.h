#pragma once

#include <string>

#include "depthservo/scenario/RobotFile.h"
#include "depthservo/servo/replayLaw.h"

namespace depthservo {

/// Another law for a robot: vpServo | task. \param law empty: as it is \throw InputError the robot
/// cannot have it
void chooseLaw(RobotFile& robot, const std::string& law);

/// Adds to the settings of a recording what `readLaw` reads.
void addLaw(SequenceSettings& settings, const RobotFile& robot, const ServoGoal& goal);

/// Robot, goal and commands that `servo --record` and `record` have kept beside a sequence.
/// \param law another one: vpServo | task; empty: that of the recording \throw InputError there are
/// none
RecordedLaw readLaw(const std::string& folder, const std::string& law);

}  // namespace depthservo
