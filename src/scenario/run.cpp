#include "depthservo/scenario/run.h"

#include <fmt/format.h>

#include <cmath>

#include "depthservo/rig/SequenceRecorder.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/scenario/recordedLaw.h"
#include "depthservo/servo/ServoLoop.h"
#include "observation/ObserverSetup.h"
#include "observation/errorsOf.h"
#include "scenario/taughtWalls.h"

namespace depthservo {
namespace {

/// Refuses a pose from which a point is not in the image.
void requireInView(const std::vector<TruePoint>& points, const Scenario& scenario,
                   const char* key) {
  const PinholeCamera camera = scenario.camera.pinhole();
  for (const TruePoint& point : points) {
    if (camera.contains(point.u, point.v)) continue;
    const std::string where = std::isnan(point.u)
                                  ? std::string("behind the camera")
                                  : fmt::format("at ({:.0f}, {:.0f}) px of {} x {}", point.u,
                                                point.v, camera.width, camera.height);
    throw InputError(
        {scenario.file, 0, key},
        fmt::format("dot {} is not in the image from there: it is {}; move or turn the robot",
                    point.id, where));
  }
}

ServoGoal goalOf(const Scenario& scenario, const SimulatedRig& rig,
                 const std::optional<TaughtWalls>& walls) {
  ServoGoal goal;
  if (walls) {
    goal = walls->goal.servoGoal(scenario.depth.initial);
    goal.cdMo = rig.cdMo();
    return goal;
  }
  goal.pixels = scenario.control.desired;
  goal.Z.assign(goal.pixels.size(), scenario.depth.initial);
  if (!scenario.robot.goal) return goal;
  const std::vector<TruePoint> points = rig.truthAtGoal();
  requireInView(points, scenario, "robot.goal");
  goal.cdMo = rig.cdMo();
  for (const TruePoint& point : points) {
    goal.pixels.emplace_back(point.u, point.v);
    goal.Z.push_back(point.Z);
  }
  return goal;
}

/// A run under way.
class Run {
 public:
  explicit Run(const Scenario& scenario)
      : scenario_(scenario),
        walls_(wallsOf(scenario)),
        rig_(walls_ ? walls_->rig : static_cast<const SimulatedRigOptions&>(scenario),
             scenario.file) {
    if (walls_) {
      rig_.teach(walls_->goal.toFind().taught);
    } else {
      requireInView(rig_.truth(), scenario, "robot.initial");
    }
    observation_ = observationOf(scenario, rig_);  // now: a moving target takes the goal along
    goal_ = goalOf(scenario, rig_, walls_);
    loop_.emplace(rig_, observation_, scenario.control, goal_);
  }

  RunLog finish(RunWatcher* watcher, Keep keep) {
    RunLog log = loop_->run(watcher, keep);
    log.command = "run";
    log.name = scenario_.name;
    if (keep == Keep::everything) log.configuration = scenario_.toJson();
    log.seed = scenario_.seed;
    if (goal_.cdMo) log.cdMc = *goal_.cdMo * rig_.cMo().inverse();
    return log;
  }

  const SimulatedRig& rig() const { return rig_; }
  const ObservationOptions& observation() const { return observation_; }
  const ServoGoal& goal() const { return goal_; }

 private:
  static std::optional<TaughtWalls> wallsOf(const Scenario& scenario) {
    if (scenario.target.type != TargetKind::wall) return std::nullopt;
    return teachWalls(scenario);
  }

  const Scenario& scenario_;
  std::optional<TaughtWalls> walls_;
  SimulatedRig rig_;
  ObservationOptions observation_;
  ServoGoal goal_;
  std::optional<ServoLoop> loop_;
};

}  // namespace

ObservationOptions observationOf(const Scenario& scenario, const SimulatedRig& rig) {
  ObservationOptions options;
  options.motion = MotionSource::twist;
  options.depth = scenario.depth;
  options.depth.pose.couplingStep_s = 1 / scenario.odometry.rate;
  if (scenario.control.coupled) {
    options.depth.pose.coupledGoal = rig.cdMo();
    options.depth.pose.kc = scenario.control.kc;
  }
  options.pixelNoise_px = scenario.sensing.assumedNoise_px();
  const bool isMeasured =
      scenario.target.type == TargetKind::wall && scenario.sensing.source == SensingSource::image;
  options.isPixelNoiseGiven = !isMeasured || scenario.sensing.assumed_noise;
  options.odometryNoise = scenario.odometry.declaredNoise();
  // A simulation without noise says nothing against the noise of a profile.
  if (scenario.odometry.noise.isZero() && errorsOf(options)) options.odometryNoise.reset();
  options.odometryScaleSigma = scenario.odometry.scale_sigma;
  options.focalSigma = scenario.camera.focal_sigma;
  return options;
}

RunLog run(const Scenario& scenario, RunWatcher* watcher, Keep keep) {
  return Run(scenario).finish(watcher, keep);
}

RunLog record(const Scenario& scenario, const std::string& folder, RunWatcher* watcher) {
  SequenceRecorder recorder(folder, watcher);
  const bool keepsLaw = canBeReplayed(scenario.control, scenario.robot.type);
  if (keepsLaw) recorder.keepCommands();
  Run run(scenario);
  RunLog log = run.finish(&recorder, Keep::everything);
  const ObservedSource& source = run.rig().source();
  const SequenceTarget& target = source.target;
  ObservationOptions observation = run.observation();
  if (observation.depth.estimator == EstimatorKind::pose) {  // a replay may have another frame rate
    observation.depth.pose.ke = observerGain(setupOf(source, observation));
  }
  SequenceSettings settings{scenario.name, source.camera, target.target, target.dots,
                            replayYaml(observation)};
  settings.tags = target.tags;
  settings.board = target.board;
  settings.rows = log.rows;
  settings.taught = target.taught;
  if (keepsLaw) addLaw(settings, {scenario.robot, {}, scenario.control}, run.goal());
  recorder.finish(settings);
  return log;
}

}  // namespace depthservo
