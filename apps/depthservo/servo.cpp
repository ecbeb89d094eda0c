#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "Interruption.h"
#include "Recording.h"
#include "View.h"
#include "commands.h"
#include "depthservo/observation/words.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/rig/SequenceRecorder.h"
#include "depthservo/scenario/RobotFile.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/scenario/recordedLaw.h"
#include "depthservo/sequence/TwistStream.h"
#include "depthservo/servo/RobotRig.h"
#include "depthservo/servo/ServoLoop.h"
#include "depthservo/servo/TaughtGoal.h"
#include "findings.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct ServoArguments {
  std::string source, goal, robot, twist, command, law, record, out;
  std::optional<RpyPose> cameraInBase;
  RecordingFiles files;
  VideoOptions video;
  ObservationArguments observation;
  RobotRigOptions rig;
  std::optional<double> gain, tolerance;
  double duration_s = 0, patience_s = 0.1;
  bool isArmed = false, hasView = false, json = false;
};

/// Shows what happens while it happens: words on stderr, a window for whoever asked for one.
class ServoWatcher : public RunWatcher {
 public:
  ServoWatcher(const RobotRig& rig, const ImageSource& images, std::unique_ptr<View> view,
               RunWatcher* next)
      : rig_(rig), images_(images), view_(std::move(view)), next_(next) {}

  /// Figures of all images; `log` may have the last ones only.
  Metrics metrics(const RunLog& log) const { return meter_ ? meter_->result(log) : Metrics(); }

  /// Images left out before the robot was on its way: while the goal was searched for.
  std::size_t leftOutAtStart() const { return leftOutAtStart_.value_or(images_.leftOut()); }

  bool onFrame(const RunFrame& frame) override {
    const double time_s = frame.record.time_s;
    if (std::isnan(first_s_)) first_s_ = time_s;
    if (!meter_) meter_.emplace(frame.log.camera, frame.log.goals);
    meter_->add(frame.record);
    if (mayMove_ && !leftOutAtStart_) leftOutAtStart_ = images_.leftOut();
    mayMove_ = rig_.reason() == SafetyReason::none;
    const std::size_t frames = frame.log.frames.size();
    if (frames <= std::exchange(frames_, frames)) told_ = 0;  // the old ones are forgotten
    for (; told_ < frame.log.events.size(); ++told_) {
      const Event& event = frame.log.events[told_];
      fmt::print(stderr, "{:8.2f} s  {}\n", event.time_s - first_s_, event.what);
    }
    const std::string words = commandWords();
    if (rig_.reason() == SafetyReason::notArmed && !(time_s < next_s_)) {
      constexpr double kEvery_s = 1;
      next_s_ = time_s + kEvery_s;
      fmt::print(stderr, "{:8.2f} s  not armed (Enter or SIGUSR1); would command {}\n",
                 time_s - first_s_, words);
    }
    if (view_) {
      view_->show(frame.exposure.image, frame.record, frame.log,
                  fmt::format("{}   wanted {}", wordsOf(rig_.reason()), words));
      if (view_->isClosed()) return false;
    }
    return !next_ || next_->onFrame(frame);
  }

 private:
  std::string commandWords() const {
    const Velocities wanted = rig_.wanted();
    std::string words;
    const auto names = rig_.robot()->velocityNames();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::size_t unit = names[i].find('[');
      words += fmt::format("{}{} {:.3f} {}", i == 0 ? "" : ", ", shortName(names[i]),
                           wanted[static_cast<Eigen::Index>(i)],
                           names[i].substr(unit + 1, names[i].size() - unit - 2));
    }
    return words;
  }

  const RobotRig& rig_;
  const ImageSource& images_;
  std::unique_ptr<View> view_;
  RunWatcher* next_;
  std::size_t told_ = 0, frames_ = 0;
  std::optional<MetricsMeter> meter_;
  std::optional<std::size_t> leftOutAtStart_;
  bool mayMove_ = false;
  double first_s_ = kUnknown, next_s_ = kUnknown;
};

/// A source whose next image has been looked at.
class PeekedSource : public ImageSource {
 public:
  explicit PeekedSource(VideoSource& source) : source_(source) {}

  /// None: there are no more.
  const TimedImage* peek() {
    ImageStatus status = ImageStatus::skipped;
    while (status == ImageStatus::skipped) status = source_.next(peeked_);
    hasPeeked_ = status == ImageStatus::image;
    return hasPeeked_ ? &peeked_ : nullptr;
  }

  void forget() { hasPeeked_ = false; }

  ImageStatus next(TimedImage& image) override {
    if (!std::exchange(hasPeeked_, false)) return source_.next(image);
    image = peeked_;
    return ImageStatus::image;
  }
  std::string reason() const override { return source_.reason(); }
  bool isLive() const override { return source_.isLive(); }
  double fps() const override { return source_.fps(); }
  std::size_t leftOut() const override { return source_.leftOut(); }

 private:
  VideoSource& source_;
  TimedImage peeked_;
  bool hasPeeked_ = false;
};

/// Those points of the goal that the robot sees from where it is. None: it is not seen.
std::optional<TaughtGoal> goalInView(const ServoArguments& a, const TaughtGoal& goal,
                                     PeekedSource& images) {
  if (goal.tracker != TrackerKind::klt) return goal;
  std::string news, told;
  double first_s = kUnknown;
  while (const TimedImage* image = images.peek()) {
    if (std::isnan(first_s)) first_s = image->time_s;
    auto seen = goal.seenIn(image->image, news);
    if (news != told) fmt::print(stderr, "{}\n", news);
    told = news;
    if (seen && !a.rig.isLockstep) images.forget();  // it is old by now
    if (seen) return seen;
    if (a.rig.isLockstep || image->time_s - first_s > a.rig.find_s) return std::nullopt;
  }
  fmt::print(stderr, "{}\n", images.reason());
  return std::nullopt;
}

LiveOptions liveOptionsOf(const ServoArguments& a, const TaughtGoal& goal, const RobotFile& robot,
                          const ImageSource& images) {
  constexpr double kUsualRate_Hz = 30;
  LiveOptions options;
  options.name = a.source;
  options.camera = goal.camera;
  options.target = goal.toFind();
  options.targetFile = a.goal;
  apply(a.observation, goal.target.tags.has_value(), options.observation);
  options.observation.tracker = goal.tracker;
  options.keep = Keep::theLastFrames;
  options.rate = images.fps() > 0 ? images.fps() : kUsualRate_Hz;
  options.duration_s = a.duration_s;
  options.patience_s = a.patience_s;
  const auto speed = RobotRig::greatestCameraSpeed(robot.robot);
  options.most_v = speed.v;
  options.most_w = speed.w;
  return options;
}

RobotFile robotOf(const ServoArguments& a) {
  RobotFile robot = readRobotFile(a.robot);
  if (!a.law.empty() && a.law != "task" && a.law != "vpServo") {
    refuseWord("--law", a.law, {"vpServo", "task"});
  }
  chooseLaw(robot, a.law);
  if (a.gain) robot.control.gain = *a.gain;
  if (a.tolerance) robot.control.tolerance = *a.tolerance;
  return robot;
}

int exitCodeOf(const RunLog& log, const RobotRig& rig, const std::atomic<bool>& stop) {
  if (log.outcome == Outcome::converged) return kMet;
  if (stop && wasCtrlC()) return kInterrupted;
  return isFault(rig.endedBy()) ? kStoppedBySafety : kOtherOutcome;
}

void tell(const ServoArguments& a, const RunLog& log, const Metrics& metrics, const RobotRig& rig,
          const ImageSource& images, std::size_t leftOutAtStart, int exitCode) {
  const RobotRigCounts& counts = rig.counts();
  const double p50 = counts.latency.percentile(0.5), p999 = counts.latency.percentile(0.999);
  const std::string outcome = exitCode == kStoppedBySafety ? "stopped by safety"
                              : exitCode == kInterrupted   ? "interrupted"
                                                           : toString(log.outcome);
  fmt::print(stderr, "{}: {} after {:.2f} s: {}\n", a.goal, outcome, metrics.duration_s,
             log.reason);
  fmt::print(stderr,
             "  {} images, {} skipped for newer ones ({} before it moved), {} empty, {} frozen; "
             "{} commands, {} not written\n",
             counts.images, images.leftOut(), leftOutAtStart, counts.empty, counts.frozen,
             counts.commands, counts.unwritten);
  if (std::isfinite(p50)) {
    fmt::print(stderr, "  image to command: p50 {:.1f} ms, p99.9 {:.1f} ms\n", 1e3 * p50,
               1e3 * p999);
  }
  printFindings(log);
  if (!a.json) return;
  auto json = nlohmann::ordered_json::parse(toJson(log, metrics));
  json["safety"] = toString(rig.endedBy());
  json["images"] = {{"taken", counts.images},
                    {"skipped", images.leftOut()},
                    {"skipped_at_start", leftOutAtStart},
                    {"empty", counts.empty},
                    {"frozen", counts.frozen}};
  json["commands"] = {{"written", counts.commands}, {"not_written", counts.unwritten}};
  json["latency_s"] = {{"p50", p50}, {"p999", p999}};  // null where there is none
  fmt::print("{}\n", json.dump());
}

std::unique_ptr<View> viewOf(const ServoArguments& a, const LiveOptions& options) {
  if (!a.hasView) return nullptr;
  return View::open(
      ViewOptions{options.camera.width, options.camera.height, 0, a.source, "--view"});
}

/// Of the recording.
SequenceSettings settingsOf(const ServoArguments& a, const TaughtGoal& goal, const LiveRig& camera,
                            const LiveOptions& options, const RunLog& log) {
  SequenceSettings settings{a.goal, goal.camera, options.target.target, options.target.dots,
                            replayYaml(camera.options())};
  settings.tags = options.target.tags;
  settings.board = options.target.board;
  settings.rows = log.rows;
  settings.taught = options.target.taught;
  return settings;
}

int servoRobot(ServoArguments& a) {
  silenceImageLibraries();
  std::signal(SIGPIPE, SIG_IGN);
  const TaughtGoal taught = readGoal(a.goal);
  const RobotFile robot = robotOf(a);
  if (!a.out.empty()) requireNewRunFolder(a.out);
  std::unique_ptr<SequenceRecorder> recorder;  // first: it takes signals to itself
  if (!a.record.empty()) recorder = std::make_unique<SequenceRecorder>(a.record);
  Recording files(a.files, recorder.get());
  const std::atomic<bool>& stop = stopOnInterruption();
  a.video.width = taught.camera.width;
  a.video.height = taught.camera.height;
  a.video.stop = &stop;
  VideoSource video(a.source, a.video);
  PeekedSource images(video);
  TwistStream twists(a.twist, a.cameraInBase);
  const auto inView = goalInView(a, taught, images);
  if (!inView) return kOtherOutcome;
  const TaughtGoal& goal = *inView;
  const LiveOptions options = liveOptionsOf(a, goal, robot, images);
  LiveRig camera(options, images, &twists);
  RobotRigOptions rigOptions = a.rig;
  rigOptions.command = a.command;
  rigOptions.robot = robot.robot;
  rigOptions.safety = robot.safety;
  rigOptions.stop = &stop;
  if (!a.isArmed) rigOptions.arm = &armOnRequest(a.twist != "-");
  auto view = viewOf(a, options);
  RobotRig rig(camera, rigOptions);
  const ServoGoal servoGoal = goal.servoGoal(camera.options().depth.initial);
  ServoLoop loop(rig, camera.options(), robot.control, servoGoal);
  const bool keepsLaw = canBeReplayed(robot.control, robot.robot.type);
  if (recorder && keepsLaw) recorder->keepCommands();
  ServoWatcher watcher(rig, images, std::move(view), &files);
  RunLog log = loop.run(&watcher, a.out.empty() ? Keep::theLastFrames : Keep::everything);
  rig.finish();
  log.command = "servo";
  log.name = a.goal;
  log.configuration = configurationOf(camera.options());
  const int exitCode = exitCodeOf(log, rig, stop);
  if (log.frames.empty()) {
    fmt::print(stderr, "no image was observed: nothing is kept\n");
  } else {
    if (recorder) {
      SequenceSettings settings = settingsOf(a, goal, camera, options, log);
      if (keepsLaw) addLaw(settings, robot, servoGoal);
      recorder->finish(settings);
    }
    files.finish(log);
    if (!a.out.empty()) writeRunFolder(log, a.out);
  }
  tell(a, log, watcher.metrics(log), rig, images, watcher.leftOutAtStart(), exitCode);
  return exitCode;
}

void addTimingOptions(CLI::App& command, ServoArguments& a) {
  command.add_option("--fps", a.video.fps, "Images per second, about [Hz]; default 30")
      ->type_name("F")
      ->check(aboveZero());
  command
      .add_option("--latency", a.video.latency_s,
                  "Age of a camera's image when it arrives [s]; default 0")
      ->type_name("S")
      ->check(within(0.0, 10.0));
  command.add_option("--patience", a.patience_s, "How long an image waits for its twists [s]")
      ->type_name("S")
      ->check(within(0.0, 60.0))
      ->capture_default_str();
  command.add_option("--duration", a.duration_s, "Stop after this time [s]; default: at the end")
      ->type_name("S")
      ->check(aboveZero());
  command.add_option("--rate", a.rig.rate, "Commands per second, at least [Hz]")
      ->type_name("F")
      ->check(within(1.0, 1000.0))
      ->capture_default_str();
  command.add_option("--ttl", a.rig.ttl, "Time to live of a command [s]")
      ->type_name("S")
      ->check(within(0.01, 10.0))
      ->capture_default_str();
  command.add_flag("--lockstep", a.rig.isLockstep,
                   "One command per image, by the images' clock: for robot --lockstep");
}

}  // namespace

void addServo(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("servo", "Drive a robot to a taught goal");
  auto a = std::make_shared<ServoArguments>();
  command
      ->add_option("--source", a->source,
                   "Camera (0, /dev/video0, rtsp://...), video file, images, or pipe of PGM")
      ->required()
      ->type_name("SOURCE");
  command->add_option("--goal", a->goal, "Folder that teach wrote")->required()->type_name("GOAL");
  command->add_option("--robot", a->robot, "YAML file of the robot; keys: depthservo keys --robot")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--twist", a->twist,
                   "Pipe (or - for stdin, or udp:ADDRESS:PORT) of timestamp,vx,vy,vz,wx,wy,wz")
      ->required()
      ->type_name("FIFO");
  addCameraInBase(*command, a->cameraInBase);
  command
      ->add_option(
          "--command", a->command,
          "Pipe (or - for stdout, or udp:ADDRESS:PORT) for sequence,timestamp,ttl,image,v,w")
      ->required()
      ->type_name("FIFO");
  command->add_flag("--arm", a->isArmed, "Move at once; without it: on Enter or SIGUSR1");
  command->add_option("--law", a->law, "vpServo | task; default: the robot's control.law")
      ->type_name("NAME");
  command->add_option("--gain", a->gain, "Instead of the robot's control.gain [1/s]")
      ->type_name("G")
      ->check(aboveZero());
  command->add_option("--tolerance", a->tolerance, "Instead of the robot's control.tolerance [px]")
      ->type_name("PX")
      ->check(aboveZero());
  addEstimatorOption(*command, a->observation);
  addObservationOptions(*command, a->observation);
  command
      ->add_option("--record", a->record, "Write images and twists as a sequence; must not exist")
      ->type_name("DIR");
  command->add_option("--out", a->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  addRecordingOptions(*command, a->files);
  command->add_flag("--view", a->hasView, "Show the image with overlay");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  addTimingOptions(*command, *a);
  command->callback([a, &exitCode] { exitCode = servoRobot(*a); });
}

}  // namespace depthservo
