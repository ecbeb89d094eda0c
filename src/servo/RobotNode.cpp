#include "depthservo/servo/RobotNode.h"

#include <utility>

#include "depthservo/servo/ServoLoop.h"
#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

constexpr double kUsualRate_Hz = 30;

/// What runs now hears what comes.
struct Sources {
  explicit Sources(const PushedImages::Options& options) : images(options) {}
  PushedImages images;
  PushedTwists twists;
};

}  // namespace

struct RobotNode::Parts : RunWatcher {
  explicit Parts(const RobotNodeOptions& o) : options(o) {
    if (o.images.isPlayback) sources = std::make_unique<Sources>(o.images);
  }

  /// Waits for the camera; none: the node is stopped.
  std::optional<PinholeCamera> begin(RunWatcher* watcher);
  void end();
  LiveOptions live(const PinholeCamera& camera) const;
  std::optional<TaughtGoal> inView(const TaughtGoal& goal);
  bool onFrame(const RunFrame& frame) override;

  const RobotNodeOptions options;
  std::atomic<bool> isStopped{false};
  RunWatcher* next = nullptr;
  const RobotRig* rig = nullptr;

  mutable std::mutex mutex;
  std::condition_variable wake;
  std::optional<PinholeCamera> camera;
  std::unique_ptr<Sources> sources;  // null: nothing runs, nor will what is played back
  TimedImage newest;
  NodeStatus status;
};

RobotNode::RobotNode(const RobotNodeOptions& options) : parts_(std::make_unique<Parts>(options)) {}

RobotNode::~RobotNode() = default;

void RobotNode::setCamera(const PinholeCamera& camera) {
  const std::lock_guard lock(parts_->mutex);
  if (parts_->camera) return;
  parts_->camera = camera;
  parts_->wake.notify_all();
}

void RobotNode::push(TimedImage image) {
  const std::lock_guard lock(parts_->mutex);
  parts_->newest = image;
  if (parts_->sources) parts_->sources->images.push(std::move(image));
}

void RobotNode::pushBaseTwist(double time_s, const Twist& base) {
  pushCameraTwist(time_s, twistOfCamera(parts_->options.baseFromCamera, base));
}

void RobotNode::pushCameraTwist(double time_s, const Twist& camera) {
  const std::lock_guard lock(parts_->mutex);
  parts_->status.odometry_s = time_s;
  if (parts_->sources) parts_->sources->twists.push({time_s, camera});
}

void RobotNode::stop(const std::string& reason) {
  parts_->isStopped = true;
  const std::lock_guard lock(parts_->mutex);
  if (parts_->sources) {
    parts_->sources->images.end(reason);
    parts_->sources->twists.end();
  }
  parts_->wake.notify_all();
}

TaughtGoal RobotNode::teach(const TeachOptions& teaching, const std::string& folder) const {
  PinholeCamera camera;
  TimedImage image;
  {
    const std::lock_guard lock(parts_->mutex);
    if (!parts_->camera || parts_->newest.image.getSize() == 0) {
      throw InputError({parts_->options.name, 0, ""}, "there is no image yet");
    }
    camera = *parts_->camera;
    image = parts_->newest;
  }
  TaughtGoal goal =
      depthservo::teach(image.image, camera, parts_->options.target, teaching, folder);
  writeGoal(goal, folder);
  return goal;
}

NodeStatus RobotNode::status() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->status;
}

RunLog RobotNode::observe(RunWatcher* watcher) {
  Parts& p = *parts_;
  const auto camera = p.begin(watcher);
  if (!camera) return {};
  LiveOptions live = p.live(*camera);
  live.target = p.options.target;
  RunLog log = depthservo::live(live, p.sources->images, &p.sources->twists, &p);
  p.end();
  return log;
}

RunLog RobotNode::servo(const TaughtGoal& taught, const ServoTask& task, CommandSink& commands,
                        RunWatcher* watcher) {
  Parts& p = *parts_;
  if (!p.begin(watcher)) return {};
  const auto goal = p.inView(taught);
  if (!goal) {
    p.end();
    RunLog log;
    log.hasOutcome = true;
    log.outcome = Outcome::lost;
    log.reason = "the goal is not seen from here";
    return log;
  }
  LiveOptions live = p.live(taught.camera);
  live.target = goal->toFind();
  live.observation.tracker = goal->tracker;
  const auto speed = RobotRig::greatestCameraSpeed(task.robot);
  live.most_v = speed.v;
  live.most_w = speed.w;
  LiveRig camera(live, p.sources->images, &p.sources->twists);
  RobotRigOptions options;
  options.sink = &commands;
  options.robot = task.robot;
  options.safety = task.safety;
  options.rate = task.rate;
  options.ttl = task.ttl;
  options.arm = task.arm;
  options.stop = &p.isStopped;
  RobotRig rig(camera, options);
  ServoLoop loop(rig, camera.options(), task.control,
                 goal->servoGoal(camera.options().depth.initial));
  p.rig = &rig;
  RunLog log = loop.run(&p, Keep::theLastFrames);
  p.rig = nullptr;
  rig.finish();
  p.end();
  log.command = "servo";
  log.name = p.options.name;
  return log;
}

std::optional<PinholeCamera> RobotNode::Parts::begin(RunWatcher* watcher) {
  std::unique_lock lock(mutex);
  wake.wait(lock, [&] { return camera.has_value() || isStopped; });
  if (isStopped) return std::nullopt;
  next = watcher;
  if (!sources) sources = std::make_unique<Sources>(options.images);
  return camera;
}

void RobotNode::Parts::end() {
  const std::lock_guard lock(mutex);
  sources.reset();
}

LiveOptions RobotNode::Parts::live(const PinholeCamera& of) const {
  LiveOptions live;
  live.name = options.name;
  live.camera = of;
  live.observation = options.observation;
  live.rate = options.images.rate > 0 ? options.images.rate : kUsualRate_Hz;
  live.keep = Keep::theLastFrames;
  live.patience_s = options.patience_s;
  return live;
}

/// Those points of the goal that are seen from here. None: it is not seen.
std::optional<TaughtGoal> RobotNode::Parts::inView(const TaughtGoal& goal) {
  constexpr int kMostLooks = 300;
  if (goal.tracker != TrackerKind::klt) return goal;
  TimedImage image;
  std::string news;
  for (int i = 0; i < kMostLooks; ++i) {
    if (sources->images.next(image) != ImageStatus::image) return std::nullopt;
    if (auto seen = goal.seenIn(image.image, news)) return seen;
  }
  return std::nullopt;
}

bool RobotNode::Parts::onFrame(const RunFrame& frame) {
  {
    const std::lock_guard lock(mutex);
    ++status.images;
    status.leftOut = sources->images.leftOut();
    status.rows = sources->twists.counts().rows;
    status.refused = sources->twists.counts().refused();
    status.image_s = frame.record.time_s;
    status.points.clear();
    for (const FeatureRecord& feature : frame.record.features) {
      ++status.points[feature.estimate.status];
    }
    if (!frame.log.events.empty()) status.news = frame.log.events.back().what;
    status.held = rig ? rig->reason() : SafetyReason::none;
  }
  return (!next || next->onFrame(frame)) && !isStopped;
}

}  // namespace depthservo
