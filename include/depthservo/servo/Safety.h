#pragma once

#include "depthservo/api.h"
#include "depthservo/motion/Velocities.h"

namespace depthservo {

/// What may be commanded, n each.
struct SafetyLimits {
  Velocities velocity;      ///< greatest size [m/s, rad/s]
  Velocities acceleration;  ///< greatest change per second while the robot follows the law
  Velocities braking;       ///< the same while it is stopped
};

struct SafetyOptions {
  double image_age = 0.1;      ///< since the newest image that shows something new was taken [s]
  double odometry_age = 0.1;   ///< since the newest row of odometry [s]
  double track_age = 5;        ///< since half of the points were last measured [s]
  double contradiction = 0.1;  ///< more than half of the points contradict the motion so long [s]
  double overrun = 0.1;        ///< the loop has been busy with one image so long [s]
  double unread = 0.1;         ///< the oldest command has not been read for so long [s]
  double calm = 0.2;   ///< without a cause for so long, a robot that was stopped goes on [s]
  double give_up = 2;  ///< a fault that holds it for longer ends the run [s]
};

/// Why the robot is held.
enum class SafetyReason {
  none,
  notArmed,
  ended,          ///< the run is over
  image,          ///< no image that shows anything new
  odometry,       ///< no odometry of now
  track,          ///< the points have not been seen for long
  contradiction,  ///< the images contradict the motion: the target was moved, or the odometry jumps
  overrun,        ///< the loop is late
  command,        ///< the law's command is not finite
  unread,         ///< nobody takes the commands
};
DEPTHSERVO_API const char* toString(SafetyReason reason);  ///< a word: "image"
DEPTHSERVO_API const char* wordsOf(SafetyReason reason);   ///< a sentence: "no new image"

/// Whether it is a fault, not just the beginning or the end.
constexpr bool isFault(SafetyReason reason) { return reason > SafetyReason::ended; }

/// What the watchdogs look at. An age that is not a number, or far below zero, is too old.
struct SafetyInput {
  double time_s = 0;  ///< of a clock that nobody sets
  double imageAge_s = 0, odometryAge_s = 0, trackAge_s = 0;
  double contradictedFor_s = 0, busyFor_s = 0, unreadFor_s = 0;
};

/// The last instance before the robot: whatever the law asks for, the velocities that are commanded
/// stay within the limits and change within them, and are braked to zero when a watchdog says so.
///
/// Following the law, all velocities are scaled by a common factor into `velocity`, and so is their
/// change into `acceleration`. Stopped, they shrink by a common factor as fast as `braking` allows,
/// so that the robot stays on its curve: from v it takes max(|v_i| / braking_i) seconds. A cause
/// that goes lets the robot go on after `calm`, by `acceleration`.
///
/// It starts at rest and not armed. Real-time: nothing allocates, locks or throws after
/// construction.
class DEPTHSERVO_API Safety {
 public:
  /// \throw std::invalid_argument limits of different sizes, more than 8, or one that is not > 0;
  /// a deadline that is not > 0
  Safety(const SafetyLimits& limits, const SafetyOptions& options);

  void arm() noexcept { isArmed_ = true; }
  void disarm() noexcept { isArmed_ = false; }
  bool isArmed() const noexcept { return isArmed_; }

  /// Stops the robot for good.
  void end() noexcept { hasEnded_ = true; }

  /// The velocities to command from now on. Between two steps they change by no more than is
  /// allowed in the time between them, 0.1 s at most; a time that does not go on changes nothing
  /// but the reason. \param wanted by the law, n
  const Velocities& step(const SafetyInput& now, const Velocities& wanted) noexcept;

  const Velocities& command() const noexcept { return command_; }

  /// Why the robot is held as of the last step, or was until less than `calm` ago.
  SafetyReason reason() const noexcept { return reason_; }

  /// How long a fault has held the armed robot [s]; 0: none does.
  double heldFor_s() const noexcept { return heldFor_s_; }

  bool isStanding() const noexcept { return command_.isZero(0); }

 private:
  SafetyReason judge(const SafetyInput& now, const Velocities& wanted) const noexcept;
  void remember(SafetyReason cause, double dt) noexcept;

  SafetyLimits limits_;
  SafetyOptions options_;
  Velocities command_;
  SafetyReason reason_ = SafetyReason::notArmed;
  bool isArmed_ = false, hasEnded_ = false;
  bool hasTime_ = false;
  double time_s_ = 0;
  double calmFor_s_ = 0, heldFor_s_ = 0;
};

}  // namespace depthservo
