#include "depthservo/servo/ServoLoop.h"

#include <fmt/format.h>
#include <visp3/core/vpException.h>

#include <algorithm>
#include <deque>
#include <limits>

#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/DotTracker.h"
#include "observation/FrameRateMonitor.h"
#include "observation/SelfDiagnosis.h"
#include "observation/Stopwatch.h"
#include "observation/TagSizeMonitor.h"
#include "observation/expectedPoints.h"
#include "observation/featureRecord.h"
#include "observation/makeEstimator.h"
#include "observation/unexcited.h"
#include "rig/CameraClock.h"
#include "rig/World.h"
#include "rig/simulatedSetup.h"
#include "servo/ControlLaw.h"
#include "servo/OutcomeJudge.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

/// The command fades from full speed to a stop, or back, within this time [s].
constexpr double kRamp_s = 0.5;

/// Share of the command below which the robot stops for hidden points: slower, it would hardly get
/// on.
constexpr double kLeastSpeed = 0.1;

/// Sigma of a depth that is told [m]: as good as exact.
constexpr double kToldSigma_Z = 1e-6;

/// Refuses a pose from which a dot is not in the image.
void requireInView(const std::vector<World::TruePoint>& points, const PinholeCamera& camera,
                   const std::string& file, const char* key) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (camera.contains(points[i].u, points[i].v)) continue;
    const std::string where = std::isnan(points[i].u)
                                  ? std::string("behind the camera")
                                  : fmt::format("at ({:.0f}, {:.0f}) px of {} x {}", points[i].u,
                                                points[i].v, camera.width, camera.height);
    throw InputError(
        {file, 0, key},
        fmt::format("dot {} is not in the image from there: it is {}; move or turn the robot", i,
                    where));
  }
}

ServoGoal goalOf(const Scenario& scenario, const World& world) {
  ServoGoal goal;
  goal.pixels = scenario.control.desired;
  goal.Z.assign(goal.pixels.size(), scenario.depth.initial);
  if (!scenario.robot.goal) return goal;
  const std::vector<World::TruePoint> points = world.goal();
  requireInView(points, scenario.camera.pinhole(), scenario.file, "robot.goal");
  goal.cdMo = world.cdMo();
  for (const World::TruePoint& point : points) {
    goal.pixels.emplace_back(point.u, point.v);
    goal.Z.push_back(point.Z);
  }
  return goal;
}

EstimatorSetup setupOf(const Scenario& s, const World& world) {
  EstimatorSetup setup = simulatedSetup(s, s.depth);
  if (s.control.coupled) setup.coupledGoal = world.cdMo();
  return setup;
}

std::optional<double> coupledGain(const Scenario& s) {
  return s.control.coupled ? std::optional(s.control.kc) : std::nullopt;
}

/// When the target stops for good [s].
double endOfMotion(const TargetOptions& target) {
  return target.twist.empty() ? 0 : target.twist.back().until;
}

}  // namespace

/// An image on its way to the controller, with what was true when it was taken.
struct ServoLoop::Exposure {
  double time_s;                       // as stamped
  vpImage<unsigned char> image;        // source: image
  std::vector<TrackedPoint> measured;  // source: geometry
  std::vector<World::TruePoint> truth;
  Eigen::Isometry3d wMc;
};

struct ServoLoop::Parts {
  explicit Parts(const Scenario& s)
      : scenario(s),
        camera(s.camera.pinhole()),
        clock(s.camera, s.seed),
        world(s),
        odometry(4096, 1 / s.odometry.rate),
        features(*makeEstimator(setupOf(s, world), s.target.points.size()), s.target.points.size()),
        frameRate(setupOf(s, world), coupledGain(s)),
        judge(s) {
    if (s.depth.estimator != EstimatorKind::pose) {
      diagnosis.emplace(s.target.points.size(), s.odometry.declaredNoise(),
                        s.sensing.assumedNoise_px() / camera.focal_px(),
                        DepthPrior{s.depth.initial}, s.depth.range(),
                        jointStatesOf(features.estimator()));
    }
  }

  Scenario scenario;
  PinholeCamera camera;
  CameraClock clock;
  World world;
  std::deque<Exposure> underway;  // taken, not yet arrived

  std::vector<Eigen::Vector2d> starts;
  std::unique_ptr<PointTracker> tracker;
  std::vector<int> ids;
  std::optional<TagSizeMonitor> tags;
  std::size_t odometryRead = 0;
  MotionBuffer odometry;

  FeaturePointGroup features;
  FrameRateMonitor frameRate;
  std::optional<SelfDiagnosis> diagnosis;  // none of a known target, which may move
  std::vector<PointObservation> observations;
  std::unique_ptr<ControlLaw> law;  // after the features, which it refers to

  std::string lawState;
  Eigen::VectorXd lastCommand;  // while tracking, at full speed
  double lastControl_s = kUnknown;
  double speed = 1;  // share of the command that is given
  OutcomeJudge::Basis basis = OutcomeJudge::Basis::nothing;
  std::vector<bool> wasMeasured;
  OutcomeJudge judge;
  RunLog log;
};

ServoLoop::ServoLoop(const Scenario& scenario) : parts_(std::make_unique<Parts>(scenario)) {
  Parts& p = *parts_;
  const PinholeCamera& camera = p.camera;
  const vpCameraParameters visp(camera.fx, camera.fy, camera.cx, camera.cy);
  const std::size_t count = scenario.target.points.size();

  requireInView(p.world.truth(), camera, scenario.file, "robot.initial");
  for (const World::TruePoint& point : p.world.truth()) p.starts.emplace_back(point.u, point.v);
  const bool throughImages = scenario.sensing.source == SensingSource::image;
  if (throughImages && scenario.target.type == TargetKind::apriltag) {
    p.tracker = std::make_unique<AprilTagTracker>(scenario.target.assumedTags());
  } else if (throughImages) {
    DotTrackerOptions options;
    options.polarity =
        scenario.sensing.light_on_dark ? DotPolarity::lightOnDark : DotPolarity::darkOnLight;
    p.tracker = std::make_unique<DotTracker>(p.starts, options);
  }

  if (scenario.target.type == TargetKind::apriltag) {
    p.tags.emplace(scenario.target.assumedTags(), camera);
  }

  for (std::size_t i = 0; i < count; ++i) {
    p.features[i].set_Z(scenario.depth.initial);
    p.features[i].setServoDepth(scenario.control.depth);
    p.features[i].setNoise(scenario.sensing.assumedNoise_px(), visp);
    p.ids.push_back(static_cast<int>(i));
  }
  const ServoGoal goal = goalOf(scenario, p.world);
  p.law = makeControlLaw(scenario, goal, p.features);
  p.lastCommand = Eigen::VectorXd::Zero(p.world.robot().velocity().size());
  p.log.goals = goal.pixels;

  p.wasMeasured.assign(count, true);
  p.log.command = "run";
  p.log.name = scenario.name;
  p.log.configuration = scenario.toJson();
  p.log.seed = scenario.seed;
  p.log.camera = camera;
  p.log.commandNames = p.world.robot().velocityNames();
  p.log.timings = {{"render", {}}, {"track", {}}, {"observe", {}}, {"control", {}}};
}

ServoLoop::~ServoLoop() = default;

std::vector<PixelPoint> ServoLoop::starts() const {
  std::vector<PixelPoint> dots;
  for (const Eigen::Vector2d& start : parts_->starts) {
    dots.push_back({static_cast<int>(dots.size()), start.x(), start.y()});
  }
  return dots;
}

RunLog ServoLoop::run(RunWatcher* watcher) {
  Parts& p = *parts_;
  const Scenario& scenario = p.scenario;
  std::optional<OutcomeJudge::Verdict> verdict;
  while (!verdict) {
    const double next = p.clock.time();
    const double arrival = p.underway.empty() ? std::numeric_limits<double>::infinity()
                                              : p.underway.front().time_s + scenario.sensing.delay;
    if (std::min(next, arrival) > scenario.duration + 1e-9) {
      verdict = {Outcome::timeout, fmt::format("not done after {:.6g} s", scenario.duration)};
    } else if (next < arrival) {
      drive(next);
      if (!p.clock.isDropped()) look(next);
      p.clock.advance();
      verdict = p.judge.atExposure(next, p.world.truth());
    } else {
      drive(fileTime(arrival));
      const Exposure exposure = std::move(p.underway.front());
      p.underway.pop_front();
      p.log.frames.push_back(process(exposure));
      const FrameRecord& frame = p.log.frames.back();
      const bool hasImage = exposure.image.getSize() > 0;
      if (hasImage) keep(exposure.image);
      if (watcher) {
        watcher->onFrame(
            {frame, hasImage ? &exposure.image : nullptr, p.log, p.world.odometry(), exposure.wMc});
      }
      if (p.law->usesFeatures()) verdict = p.judge.afterCommand(p.log, p.basis);
      const bool isOver = p.world.time() >= endOfMotion(scenario.target);
      if (verdict && verdict->outcome != Outcome::lost && !isOver) verdict.reset();
      if (!frame.command.allFinite()) {
        verdict = {Outcome::diverged, "the control law gave a command that is not finite"};
      }
    }
  }
  if (p.diagnosis) p.log.diagnosis = p.diagnosis->result();
  p.log.joint = jointStatesOf(p.features.estimator());
  p.log.hasOutcome = true;
  p.log.outcome = verdict->outcome;
  p.log.reason = verdict->reason;
  p.log.frameRate = p.frameRate.report();
  addUnexcitedEvents(p.log);
  return std::move(p.log);
}

void ServoLoop::drive(double until_s) {
  Parts& p = *parts_;
  p.world.advanceTo(until_s, [&] {
    if (p.log.frames.empty() && p.law->usesFeatures()) return;  // nothing is known yet
    const bool isSteered = p.basis == OutcomeJudge::Basis::features && p.speed == 1;
    if (!isSteered && p.law->usesFeatures()) return;  // the command fades
    readOdometry();
    const auto command = p.law->between({p.world.robot(), p.odometry, p.world.time()});
    if (command) p.world.setCommand(*command);
  });
}

void ServoLoop::readOdometry() {
  Parts& p = *parts_;
  const auto& rows = p.world.odometry();
  for (; p.odometryRead < rows.size(); ++p.odometryRead) {
    p.odometry.push(rows[p.odometryRead].time_s, rows[p.odometryRead].twist);
  }
}

void ServoLoop::look(double time_s) {
  Parts& p = *parts_;
  const double stamp_s = fileTime(time_s + p.scenario.sensing.latency);
  Exposure exposure{stamp_s, {}, {}, p.world.truth(), p.world.robot().wMc()};
  Stopwatch watch;
  if (p.scenario.sensing.source == SensingSource::image) {
    p.world.expose(exposure.image);
  } else {
    exposure.measured = p.world.measure();
  }
  p.log.timings[0].second.push_back(watch.lap());
  p.underway.push_back(std::move(exposure));
}

FrameRecord ServoLoop::process(const Exposure& exposure) {
  Parts& p = *parts_;
  const CameraRobot& robot = p.world.robot();
  FrameRecord record;
  record.time_s = exposure.time_s;
  record.robotPose = robot.floorPose();
  record.applied = robot.velocity();

  readOdometry();
  if (!p.world.odometry().empty()) record.twist = p.world.odometry().back().twist;

  observe(exposure, record);
  record.command = control(record);
  p.world.setCommand(record.command);
  return record;
}

void ServoLoop::observe(const Exposure& exposure, FrameRecord& record) {
  Parts& p = *parts_;
  Stopwatch watch;
  const PointSetEstimator& estimator = p.features.estimator();
  std::vector<TrackedPoint> points =
      p.tracker ? p.tracker->track(exposure.image, expectedPoints(estimator, p.ids, p.odometry,
                                                                  exposure.time_s, p.camera))
                : exposure.measured;
  p.log.timings[1].second.push_back(watch.lap());

  p.observations.clear();
  const double sigma_px = p.scenario.sensing.assumedNoise_px();
  const double sigma = sigma_px / p.camera.focal_px();
  for (TrackedPoint& point : points) {
    point.sigma_px = sigma_px;
    const Eigen::Vector2d s = p.camera.normalise(point.u, point.v);
    p.observations.push_back({point.id, {s.x(), s.y(), sigma}});
    p.features[static_cast<std::size_t>(point.id)].set_x(s.x());
    p.features[static_cast<std::size_t>(point.id)].set_y(s.y());
  }
  p.features.observe(p.odometry, exposure.time_s, p.world.time());
  if (p.scenario.depth.estimator == EstimatorKind::trueDepth) {
    for (std::size_t i = 0; i < p.features.size(); ++i) {
      p.features.setDepth(i, exposure.truth[i].Z, kToldSigma_Z);
    }
  }
  if (p.tags) {
    for (std::string& event : p.tags->compare(points, estimator)) {
      note(exposure.time_s, std::move(event));
    }
    p.log.tags = p.tags->results();
  }
  p.log.timings[2].second.push_back(watch.lap());
  if (const auto news = p.frameRate.watch(estimator)) note(exposure.time_s, *news);
  if (p.diagnosis) {
    const auto news = p.diagnosis->see(exposure.time_s, p.odometry, p.observations);
    if (news) note(exposure.time_s, *news);
  }

  for (std::size_t i = 0; i < p.features.size(); ++i) {
    DepthEstimate estimate = estimator.estimate(p.ids[i]);
    if (estimate.status == DepthStatus::unset) continue;
    if (p.diagnosis) estimate = p.diagnosis->honest(estimate);
    FeatureRecord feature =
        featureRecord(p.ids[i], estimate, points, p.camera, p.diagnosis ? &*p.diagnosis : nullptr);
    const World::TruePoint& truth = exposure.truth[i];
    feature.Z_true = truth.Z;
    feature.u_true = truth.u;
    feature.v_true = truth.v;
    record.features.push_back(feature);
    if (feature.measured != p.wasMeasured[i]) {
      note(exposure.time_s, fmt::format("{} {} {}", p.tags ? "corner" : "dot", i,
                                        feature.measured ? "seen again" : "hidden"));
      p.wasMeasured[i] = feature.measured;
    }
  }
}

Eigen::VectorXd ServoLoop::control(FrameRecord& record) {
  Parts& p = *parts_;
  Stopwatch watch;
  const double wanted = p.law->usesFeatures() ? wantedSpeed() : 1;
  setBasis(record.time_s, wanted);
  const double elapsed_s = std::isnan(p.lastControl_s) ? 0 : record.time_s - p.lastControl_s;
  p.lastControl_s = record.time_s;
  p.speed = std::clamp(wanted, p.speed - elapsed_s / kRamp_s, p.speed + elapsed_s / kRamp_s);
  if (p.basis == OutcomeJudge::Basis::nothing && p.law->usesFeatures()) {
    return p.lastCommand * p.speed;
  }

  if (!p.log.goals.empty() && p.basis != OutcomeJudge::Basis::nothing) {
    record.error_px = imageError();
  }
  Eigen::VectorXd command = Eigen::VectorXd::Constant(p.lastCommand.size(), kUnknown);
  try {
    command = p.law->command({p.world.robot(), p.odometry, p.world.time()});
    noteState(record.time_s);
  } catch (const vpException& error) {
    note(record.time_s, std::string("no command: ") + error.getMessage());
  }
  p.lastCommand = command;
  p.log.timings[3].second.push_back(watch.lap());
  return command * p.speed;
}

double ServoLoop::wantedSpeed() const {
  const Parts& p = *parts_;
  double sigma_px = 0;
  for (std::size_t i = 0; i < p.features.size(); ++i) {
    const DepthEstimate& estimate = p.features[i].estimate();
    if (estimate.status == DepthStatus::unset || estimate.status == DepthStatus::lost) return 0;
    if (!p.wasMeasured[i]) {
      sigma_px = std::max(sigma_px, estimate.sigma_xy * p.camera.focal_px());
    }
  }
  const double speed = std::min(1.0, 2 - 2 * sigma_px / p.scenario.control.hidden_sigma);
  return speed < kLeastSpeed ? 0 : speed;
}

void ServoLoop::setBasis(double time_s, double wanted) {
  using Basis = OutcomeJudge::Basis;
  Parts& p = *parts_;
  const Basis before = p.basis;
  const bool isLost = std::any_of(p.ids.begin(), p.ids.end(), [&](int id) {
    const DepthStatus status = p.features[static_cast<std::size_t>(id)].estimate().status;
    return status == DepthStatus::unset || status == DepthStatus::lost;
  });
  p.basis = isLost        ? Basis::nothing
            : wanted == 0 ? Basis::waiting
            : wanted < 1  ? Basis::slowed
                          : Basis::features;
  if (p.basis == before || !p.law->usesFeatures() || p.log.frames.empty()) return;
  switch (p.basis) {
    case Basis::nothing:
      return note(time_s, "lost: the command fades out");
    case Basis::waiting:
      return note(time_s, "hidden points are predicted too vaguely: the robot waits");
    case Basis::slowed:
      return note(time_s, "hidden points are predicted vaguely: the robot slows down");
    case Basis::features:
      return note(time_s, "full speed");
  }
}

double ServoLoop::imageError() const {
  const Parts& p = *parts_;
  double squared_px = 0;
  for (std::size_t i = 0; i < p.features.size(); ++i) {
    const Eigen::Vector2d pixel = p.camera.toPixel(p.features[i].get_x(), p.features[i].get_y());
    squared_px += (pixel - p.log.goals[i]).squaredNorm();
  }
  return std::sqrt(squared_px / static_cast<double>(p.features.size()));
}

void ServoLoop::noteState(double time_s) {
  Parts& p = *parts_;
  const std::string state = p.law->state();
  if (state != p.lawState) note(time_s, state.empty() ? p.lawState + ": ended" : state);
  p.lawState = state;
}

void ServoLoop::keep(const vpImage<unsigned char>& image) {
  std::vector<unsigned char> bytes(image.bitmap, image.bitmap + image.getSize());
  auto& images = parts_->log.images;
  if (images.empty()) {
    images.emplace_back("first", std::move(bytes));
  } else if (images.size() == 1) {
    images.emplace_back("last", std::move(bytes));
  } else {
    images.back().second = std::move(bytes);
  }
}

void ServoLoop::note(double time_s, const std::string& what) {
  parts_->log.events.push_back({time_s, what});
}

}  // namespace depthservo
