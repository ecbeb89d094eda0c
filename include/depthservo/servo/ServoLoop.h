#pragma once

#include <memory>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/rig/observe.h"
#include "depthservo/servo/ServoGoal.h"
#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

/// The closed loop over a rig: image in, command out, until the robot is at its goal or the outcome
/// is another.
///
/// Every image: observe the points, let the control law compute the command, drive. What can go
/// wrong becomes a safe command and an outcome:
/// - points are hidden, or out of the image: their features are predicted and the servo goes on;
/// when one is predicted too vaguely the robot slows down to a stop and waits for it, at last in
/// vain: `lost`, or `left-image` if it is not in the image;
/// - a feature is lost: the command ramps to zero; after a second the run ends, `lost`;
/// - fewer than three dots are in the image for two seconds: `left-image`;
/// - the command is not finite: the robot stops, `diverged`;
/// - the camera comes closer than Z_min: `collision`;
/// - the robot has all but stopped and the image error, still too large, does not shrink:
/// `stalled`.
///
/// Until the robot has been free to move, the log has the last images only: who does not arm it
/// can wait for days.
class DEPTHSERVO_API ServoLoop {
 public:
  /// \param rig with a robot; outlives the loop \param goal of the points 0..n-1, or empty for a
  /// law without one \throw InputError the rig lacks what the options ask for
  ServoLoop(Rig& rig, const ObservationOptions& observation, const ControlOptions& control,
            const ServoGoal& goal);
  ~ServoLoop();

  /// The whole run; call once. Never throws for what happens in the loop. \param watcher may be
  /// null \param keep the last frames alone are those that the outcome is judged by
  RunLog run(RunWatcher* watcher = nullptr, Keep keep = Keep::everything);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
