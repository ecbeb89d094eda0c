#include "depthservo/servo/ServoLoop.h"

#include <visp3/core/vpException.h>

#include <algorithm>

#include "depthservo/observation/UnexcitedPeriods.h"
#include "depthservo/visp/visp.h"
#include "observation/Spares.h"
#include "observation/Stopwatch.h"
#include "servo/ControlLaw.h"
#include "servo/OutcomeJudge.h"
#include "servo/SpeedGovernor.h"

namespace depthservo {

struct ServoLoop::Parts : Rig::Listener {
  Parts(Rig& r, const ObservationOptions& o, const ControlOptions& c, const ServoGoal& goal)
      : rig(r),
        camera(r.source().camera),
        observer(r.source(), o),
        features(observer.ids().size(), observer.estimator().range()),
        law(makeControlLaw({c, goal, camera, r.robot()->mobility(), r.source().rowPeriod_s,
                            1 / r.source().frameRate, r.source().place},
                           features, observer.estimator())),
        governor(c.hidden_sigma, camera.focal_px()),
        judge(camera, c, o.depth.Z_min, observer.ids().size(),
              r.source().target.hasCorners() ? "corner" : "dot"),
        lastCommand(Velocities::Zero(r.robot()->velocityLimits().size())) {
    for (std::size_t i = 0; i < features.size(); ++i) {
      features[i].set_Z(o.depth.initial);
      features[i].setServoDepth(c.depth);
    }
    log.goals = goal.pixels;
    log.camera = camera;
    log.commandNames = r.robot()->velocityNames();
    log.hasOutcome = true;
  }

  void onRow(double time_s) override;
  bool onExposure(double time_s, const std::vector<TruePoint>& truth) override;
  void process(const Exposure& exposure);
  Velocities control(FrameRecord& frame);
  Velocities commandOf(const FrameRecord& frame);
  void letGoOfTheOld(double now_s);
  void judgeFrame();
  double imageError() const;  // [px]
  void note(double time_s, std::string what) { log.events.push_back({time_s, std::move(what)}); }
  ControlInput input() const { return {*rig.robot(), observer.odometry(), rig.time()}; }

  Rig& rig;
  PinholeCamera camera;
  mutable Observer observer;
  PointFeatures features;
  std::unique_ptr<ControlLaw> law;  // after the features, which it refers to
  SpeedGovernor governor;
  OutcomeJudge judge;
  std::string activity;    // of the law
  Velocities lastCommand;  // while tracking, at full speed
  std::optional<OutcomeJudge::Verdict> verdict;
  LastLaps controlTimes;  // [s]
  Keep keep = Keep::everything;
  bool hasBegun = false;  // the robot has followed a command
  RunLog log;
  Spares<FrameRecord> spares;  // that were let go of
};

ServoLoop::ServoLoop(Rig& rig, const ObservationOptions& observation, const ControlOptions& control,
                     const ServoGoal& goal)
    : parts_(std::make_unique<Parts>(rig, observation, control, goal)) {}

ServoLoop::~ServoLoop() = default;

RunLog ServoLoop::run(RunWatcher* watcher, Keep keep) {
  Parts& p = *parts_;
  p.keep = keep;
  if (keep == Keep::theOutcome) p.observer.omitDiagnosis();
  while (!p.verdict) {
    auto exposure = p.rig.next(&p);
    if (!exposure) {
      if (!p.verdict) p.verdict = {Outcome::timeout, p.rig.whyEnded()};
      break;
    }
    p.process(*exposure);
    if (watcher && !watcher->onFrame({p.log.frames.back(), *exposure, p.log, p.rig})) {
      p.verdict = {Outcome::timeout, "stopped by the user"};
      break;
    }
    p.judgeFrame();
    p.rig.giveBack(std::move(*exposure));
  }
  p.log.outcome = p.verdict->outcome;
  p.log.reason = p.verdict->reason;
  p.observer.finish(p.log);
  p.log.timings.emplace_back("control", p.controlTimes.take());
  if (keep == Keep::everything) addUnexcitedEvents(p.log);
  return std::move(p.log);
}

/// Some laws command at the rate of the odometry.
void ServoLoop::Parts::onRow(double time_s) {
  if (law->usesFeatures() && (log.frames.empty() || !governor.isFree())) return;
  rig.readOdometry(observer.odometry(), time_s);
  if (const auto command = law->between(input())) rig.command(*command);
}

bool ServoLoop::Parts::onExposure(double time_s, const std::vector<TruePoint>& truth) {
  verdict = judge.atExposure(time_s, truth);
  return !verdict;
}

void ServoLoop::Parts::process(const Exposure& exposure) {
  hasBegun = hasBegun || !rig.isHeld();
  if (!hasBegun) forgetTheOld(log);
  rig.readOdometry(observer.odometry(), exposure.time_s);
  FrameRecord frame = observer.observe(exposure, spares.take());
  rig.describe(frame);
  rig.onObserved(frame);
  takeEvents(log, rig, observer);
  features.publish(observer.estimator(), observer.measured(), observer.odometry(), rig.time());
  frame.command = control(frame);
  rig.command(frame.command);
  if (keep == Keep::everything) return append(log, std::move(frame), exposure, keep);
  letGoOfTheOld(exposure.time_s);
  log.frames.push_back(std::move(frame));
}

/// Half of what is kept at a time, and the events.
void ServoLoop::Parts::letGoOfTheOld(double now_s) {
  const auto isOld = [&](const FrameRecord& frame) {
    return now_s - frame.time_s > OutcomeJudge::kLooksBack_s;
  };
  if (log.frames.empty() || !isOld(log.frames[(log.frames.size() - 1) / 2])) return;
  const auto young = std::find_if_not(log.frames.begin(), log.frames.end(), isOld);
  std::for_each(log.frames.begin(), young, [&](FrameRecord& old) { spares.give(std::move(old)); });
  log.frames.erase(log.frames.begin(), young);
  log.events.clear();
}

Velocities ServoLoop::Parts::control(FrameRecord& frame) {
  Stopwatch watch;
  const Basis before = governor.basis();
  if (law->usesFeatures()) {
    governor.update(frame.time_s, features, observer.measured());
    if (governor.basis() != before && !log.frames.empty()) {
      note(frame.time_s, toString(governor.basis()));
    }
    if (governor.basis() == Basis::nothing) return lastCommand * governor.speed();
  } else {
    governor.release();
  }
  if (!log.goals.empty()) frame.error_px = imageError();
  lastCommand = commandOf(frame);
  if (keep != Keep::theOutcome) controlTimes.add(watch.lap());
  return lastCommand * governor.speed();
}

/// Not finite where the law has none.
Velocities ServoLoop::Parts::commandOf(const FrameRecord& frame) {
  Velocities command = Velocities::Constant(lastCommand.size(), kUnknown);
  try {
    command = law->command(input());
  } catch (const DEPTHSERVO_VISP vpException& error) {
    note(frame.time_s, std::string("no command: ") + error.getMessage());
    return command;
  }
  const char* now = law->activity();
  if (now != activity) note(frame.time_s, *now == '\0' ? activity + ": ended" : now);
  activity = now;
  return command;
}

void ServoLoop::Parts::judgeFrame() {
  if (rig.isHeld()) return judge.restart();
  if (law->usesFeatures()) verdict = judge.afterCommand(log, governor.basis());
  if (verdict && verdict->outcome != Outcome::lost && rig.isTargetMoving()) verdict.reset();
  if (!log.frames.back().command.allFinite()) {
    verdict = {Outcome::diverged, "the control law gave a command that is not finite"};
  }
}

double ServoLoop::Parts::imageError() const {
  double squared_px = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Eigen::Vector2d pixel = camera.toPixel(features[i].get_x(), features[i].get_y());
    squared_px += (pixel - log.goals[i]).squaredNorm();
  }
  return std::sqrt(squared_px / static_cast<double>(features.size()));
}

}  // namespace depthservo
