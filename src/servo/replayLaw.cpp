#include "depthservo/servo/replayLaw.h"

#include <algorithm>
#include <utility>

#include "depthservo/observation/words.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/servo/ServoLoop.h"
#include "robots/makeRobot.h"

namespace depthservo {
namespace {

/// A recording with the robot that was commanded then. It is held: its images are those of the
/// commands of then.
class RecordedRobot : public Rig {
 public:
  RecordedRobot(const Sequence& sequence, const ObservationOptions& options, const RecordedLaw& law)
      : rows_(sequence.odometry()),
        recording_(sequence, options),
        robot_(makeRobot(law.robot, law.robot.initial)),
        recorded_(law.commands) {}

  const ObservationOptions& options() const { return recording_.options(); }
  std::vector<LawCommand> takeCommands() { return std::move(commands_); }

  const ObservedSource& source() const override { return recording_.source(); }
  std::optional<Exposure> next(Listener* listener) override {
    auto exposure = recording_.next(listener);
    for (Event& event : recording_.takeEvents()) note(event.time_s, std::move(event.what));
    if (exposure) now_ = thenAt(exposure->time_s);
    return exposure;
  }
  void readOdometry(MotionBuffer& odometry, double /*time_s*/) override {
    for (; used_.size() < std::min(now_.rows, rows_.size()); used_.push_back(rows_[used_.size()])) {
      odometry.push(rows_[used_.size()].time_s, rows_[used_.size()].twist);
    }
  }
  const std::vector<OdometryRow>& odometry() const override { return used_; }
  void command(const Velocities& velocities) override {
    if (!velocities.allFinite()) return;
    commands_.push_back({now_.time_s, now_.at_s, now_.rows, velocities});
  }
  bool isHeld() const override { return true; }
  const RobotModel* robot() const override { return robot_.get(); }
  double time() const override { return now_.at_s; }
  std::string whyEnded() const override { return "the recording has ended"; }

 private:
  /// When the image was dealt with, and what was known then; where it had no command: at once.
  LawCommand thenAt(double time_s) const {
    const auto found = std::lower_bound(recorded_.begin(), recorded_.end(), time_s,
                                        [](const LawCommand& c, double t) { return c.time_s < t; });
    if (found != recorded_.end() && found->time_s == time_s) return *found;
    const auto known = std::count_if(rows_.begin(), rows_.end(),
                                     [&](const OdometryRow& row) { return row.time_s < time_s; });
    return {time_s, time_s, static_cast<std::size_t>(known), {}};
  }

  const std::vector<OdometryRow>& rows_;
  RecordedRig recording_;
  std::unique_ptr<SimulatedRobot> robot_;
  const std::vector<LawCommand>& recorded_;
  LawCommand now_;
  std::vector<OdometryRow> used_;
  std::vector<LawCommand> commands_;
};

}  // namespace

bool canBeReplayed(const ControlOptions& control, RobotKind robot) {
  const bool isByImages = control.law == Law::vpServo || control.law == Law::task;
  const bool hasJoints = robot == RobotKind::panUnicycle || robot == RobotKind::mobileManipulator;
  return isByImages && !control.excite && !hasJoints;
}

LawReplay replayLaw(const Sequence& sequence, const ObservationOptions& observation,
                    const RecordedLaw& law, RunWatcher* watcher) {
  RecordedRobot rig(sequence, observation, law);
  ServoLoop loop(rig, rig.options(), law.control, law.goal);
  LawReplay replay;
  replay.log = loop.run(watcher);
  replay.log.hasOutcome = false;
  replay.log.command = "replay";
  replay.log.name = sequence.name();
  replay.log.configuration = configurationOf(rig.options());
  replay.log.odometry = rig.odometry();
  replay.commands = rig.takeCommands();
  return replay;
}

}  // namespace depthservo
