#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/rig/observe.h"
#include "depthservo/robots/RobotOptions.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/servo/ServoGoal.h"
#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

/// What commanded the robot of a recording, and what it commanded.
struct RecordedLaw {
  RobotOptions robot;
  ControlOptions control;  ///< law vpServo or task, without excitation
  ServoGoal goal;
  std::vector<LawCommand> commands;
};

/// Whether a recording can tell what this law would command: it looks at nothing but images,
/// odometry, and a robot whose camera stands still in it.
DEPTHSERVO_API bool canBeReplayed(const ControlOptions& control, RobotKind robot);

struct LawReplay {
  RunLog log;                        ///< without an outcome: nobody followed the commands
  std::vector<LawCommand> commands;  ///< as computed again; none after an image without one
};

/// Observes a recording and computes what the law commands after each of its images, with the rows
/// of odometry that were known then. The law of the recording, observing as it did, gives the
/// commands of the recording to the last bit. \param watcher may be null \throw InputError the
/// sequence or the robot lacks what the options ask for
DEPTHSERVO_API LawReplay replayLaw(const Sequence& sequence, const ObservationOptions& observation,
                                   const RecordedLaw& law, RunWatcher* watcher = nullptr);

}  // namespace depthservo
