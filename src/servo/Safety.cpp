#include "depthservo/servo/Safety.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "robots/limits.h"
#include "text/require.h"

namespace depthservo {
namespace {

/// A step after a longer pause counts as one of this length [s]: what the robot did meanwhile is
/// not known.
constexpr double kLongestStep_s = 0.1;

bool isWithin(double age_s, double deadline_s) { return std::abs(age_s) <= deadline_s; }

/// Deadlines of ages, in the order in which they are looked at.
struct Watchdog {
  SafetyReason reason;
  double SafetyInput::*age;
  double SafetyOptions::*deadline;
};
constexpr Watchdog kWatchdogs[] = {
    {SafetyReason::image, &SafetyInput::imageAge_s, &SafetyOptions::image_age},
    {SafetyReason::odometry, &SafetyInput::odometryAge_s, &SafetyOptions::odometry_age},
    {SafetyReason::overrun, &SafetyInput::busyFor_s, &SafetyOptions::overrun},
    {SafetyReason::contradiction, &SafetyInput::contradictedFor_s, &SafetyOptions::contradiction},
    {SafetyReason::track, &SafetyInput::trackAge_s, &SafetyOptions::track_age},
    {SafetyReason::unread, &SafetyInput::unreadFor_s, &SafetyOptions::unread}};

}  // namespace

const char* toString(SafetyReason reason) {
  switch (reason) {
    case SafetyReason::none:
      return "none";
    case SafetyReason::notArmed:
      return "not-armed";
    case SafetyReason::ended:
      return "ended";
    case SafetyReason::image:
      return "image";
    case SafetyReason::odometry:
      return "odometry";
    case SafetyReason::track:
      return "track";
    case SafetyReason::contradiction:
      return "contradiction";
    case SafetyReason::overrun:
      return "overrun";
    case SafetyReason::command:
      return "command";
    case SafetyReason::unread:
      return "unread";
  }
  return "";
}

const char* wordsOf(SafetyReason reason) {
  switch (reason) {
    case SafetyReason::none:
      return "the robot follows the law";
    case SafetyReason::notArmed:
      return "not armed";
    case SafetyReason::ended:
      return "the run is over";
    case SafetyReason::image:
      return "no image that shows anything new: camera unplugged, frozen, black or late";
    case SafetyReason::odometry:
      return "no odometry of now: it has ended, is late, or cannot be used";
    case SafetyReason::track:
      return "the points have not been seen for long";
    case SafetyReason::contradiction:
      return "more than half of the points contradict the odometry: was the target moved, did the "
             "odometry jump?";
    case SafetyReason::overrun:
      return "the loop takes too long for an image";
    case SafetyReason::command:
      return "the law's command is not finite";
    case SafetyReason::unread:
      return "nobody takes the commands";
  }
  return "";
}

Safety::Safety(const SafetyLimits& limits, const SafetyOptions& options)
    : limits_(limits), options_(options), command_(Velocities::Zero(limits.velocity.size())) {
  const Eigen::Index n = limits.velocity.size();
  detail::require("Safety", n > 0, "no velocity");
  for (const Velocities* each : {&limits.velocity, &limits.acceleration, &limits.braking}) {
    detail::require("Safety", each->size() == n, "limits of different sizes");
    detail::require("Safety", (each->array() > 0).all(), "a limit is not above zero");
  }
  for (const Watchdog& dog : kWatchdogs)
    detail::require("Safety", options.*dog.deadline > 0, "a deadline is not > 0");
  detail::require("Safety", options.calm >= 0, "calm is below zero");
}

SafetyReason Safety::judge(const SafetyInput& now, const Velocities& wanted) const noexcept {
  if (hasEnded_) return SafetyReason::ended;
  for (const Watchdog& dog : kWatchdogs) {
    if (!isWithin(now.*dog.age, options_.*dog.deadline)) return dog.reason;
  }
  if (wanted.size() != command_.size() || !wanted.allFinite()) return SafetyReason::command;
  return isArmed_ ? SafetyReason::none : SafetyReason::notArmed;
}

/// A fault stays the reason until it has been gone for a while.
void Safety::remember(SafetyReason cause, double dt) noexcept {
  const bool isCalm = !isFault(cause);
  calmFor_s_ = isCalm ? calmFor_s_ + dt : 0;
  const bool isStillHeld =
      isCalm && cause != SafetyReason::ended && isFault(reason_) && calmFor_s_ < options_.calm;
  if (!isStillHeld) reason_ = cause;
  heldFor_s_ = isArmed_ && isFault(reason_) ? heldFor_s_ + dt : 0;
}

const Velocities& Safety::step(const SafetyInput& now, const Velocities& wanted) noexcept {
  double dt = hasTime_ ? std::min(now.time_s - time_s_, kLongestStep_s) : 0;
  if (!(dt > 0)) dt = 0;  // nor a number
  if (std::isfinite(now.time_s) && (!hasTime_ || now.time_s > time_s_)) {
    time_s_ = now.time_s;
    hasTime_ = true;
  }
  remember(judge(now, wanted), dt);
  if (reason_ != SafetyReason::none) {
    command_ *= brakingFactor(command_, limits_.braking, dt);
    return command_;
  }
  const Velocities allowed = wanted * commonFactor(wanted, limits_.velocity);
  const Velocities change = allowed - command_;
  const Velocities quickest = limits_.acceleration * dt;
  command_ += change * commonFactor(change, quickest);
  return command_;
}

}  // namespace depthservo
