#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "Interruption.h"
#include "Recording.h"
#include "View.h"
#include "commands.h"
#include "depthservo/observation/words.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/rig/LiveRig.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/sequence/TwistStream.h"
#include "findings.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct LiveArguments {
  std::string source, camera, twist, target, motion, times, out, tracker = "auto";
  std::optional<RpyPose> cameraInBase;
  RecordingFiles files;
  VideoOptions video;
  ObservationArguments observation;
  double duration_s = 0;
  std::optional<double> patience_s;
  bool noWindow = false, json = false;
};

std::vector<double> readTimes(const std::string& file) {
  std::vector<double> times;
  for (const ListedImage& image : readImageList(file)) times.push_back(image.time_s);
  return times;
}

std::unique_ptr<View> viewOf(const LiveArguments& arguments, const LiveOptions& options,
                             const VideoSource& images, std::function<void()> whenClosed) {
  if (arguments.noWindow) return nullptr;
  const char* display = std::getenv("DISPLAY");
  if (!display || !*display) return nullptr;
  try {
    return View::open(ViewOptions{options.camera.width, options.camera.height,
                                  images.isLive() ? 0 : images.fps(), arguments.source, "",
                                  std::move(whenClosed)});
  } catch (const InputError&) {
    return nullptr;
  }
}

/// \param metrics of all frames; the log may have the last ones only
void finish(const LiveArguments& arguments, const RunLog& log, const Metrics& metrics,
            Recording& recorder) {
  recorder.finish(log);
  if (!arguments.out.empty()) writeRunFolder(log, arguments.out);
  printTable(log, metrics);
  printFindings(log);
  fmt::print(stderr, "{}\n", log.reason);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(log, metrics));
  std::fflush(nullptr);
}

/// Shows what is observed, until the user has seen enough.
class LiveWatcher : public RunWatcher {
 public:
  /// \param view may be null \param shown the log while the window draws
  LiveWatcher(View* view, const RunLog*& shown, MetricsMeter& meter, Recording& recorder,
              const std::atomic<bool>& stop)
      : view_(view), shown_(shown), meter_(meter), recorder_(recorder), stop_(stop) {}

  bool onFrame(const RunFrame& frame) override {
    recorder_.onFrame(frame);
    meter_.add(frame.record);
    if (view_) {
      std::string status;
      if (const auto* twists = static_cast<const LiveRig&>(frame.rig).twists()) {
        status = fmt::format("twists: {} rows, {} refused", twists->rows, twists->refused());
      }
      if (!frame.log.events.empty()) {
        status += (status.empty() ? "" : "   ") + frame.log.events.back().what;
      }
      shown_ = &frame.log;
      view_->show(frame.exposure.image, frame.record, frame.log, status);
      if (view_->isClosed()) return false;
      shown_ = nullptr;
    }
    return !stop_;
  }

 private:
  View* view_;
  const RunLog*& shown_;
  MetricsMeter& meter_;
  Recording& recorder_;
  const std::atomic<bool>& stop_;
};

int watchLive(const LiveArguments& arguments) {
  silenceImageLibraries();
  LiveOptions options;
  options.camera = requiredCamera(arguments.camera);
  if (!arguments.target.empty()) {
    options.target = readTarget(arguments.target);
    options.targetFile = arguments.target;
    options.observation = observationOf(options.target.replay);
  }
  apply(arguments.observation, options.target.tags.has_value(), options.observation);
  options.observation.tracker = trackerNamed(arguments.tracker, {"--tracker", 0, ""});
  if (arguments.motion != "twist" && arguments.motion != "target" && !arguments.motion.empty()) {
    refuseWord("--motion", arguments.motion, {"twist", "target"});
  }
  if (arguments.motion == "twist" && arguments.twist.empty()) {
    refuseOption("--motion", "twist needs --twist FIFO, or --twist - for standard input");
  }
  if (arguments.cameraInBase && arguments.twist.empty()) {
    refuseOption("--camera-in-base", "is for rows of a base's twists, and there is no --twist");
  }
  if (arguments.motion == "target" && !arguments.twist.empty()) {
    refuseOption("--twist", "is not used with --motion target; leave one of them out");
  }
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);

  VideoOptions video = arguments.video;
  video.width = options.camera.width;
  video.height = options.camera.height;
  if (!arguments.times.empty()) video.times = readTimes(arguments.times);
  Recording recorder(arguments.files);  // first: it takes signals to itself
  const std::atomic<bool>& stop = stopOnInterruption();
  video.stop = &stop;
  VideoSource images(arguments.source, video);
  std::unique_ptr<TwistStream> twists;
  if (!arguments.twist.empty())
    twists = std::make_unique<TwistStream>(arguments.twist, arguments.cameraInBase);

  constexpr double kCameraPatience_s = 0.1, kFilePatience_s = 2;
  options.name = arguments.source;
  options.rate = images.fps();
  options.duration_s = arguments.duration_s;
  options.keep = arguments.out.empty() ? Keep::theLastFrames : Keep::everything;
  options.patience_s =
      arguments.patience_s.value_or(images.isLive() ? kCameraPatience_s : kFilePatience_s);
  MetricsMeter meter(options.camera, {});
  const RunLog* shown = nullptr;  // while the window draws
  const std::unique_ptr<View> view = viewOf(arguments, options, images, [&] {
    if (!shown) return;
    RunLog log = *shown;
    log.reason = "the window was closed";
    finish(arguments, log, meter.result(log), recorder);
  });
  if (!view && !arguments.noWindow) fmt::print(stderr, "note: no display, hence no window\n");

  LiveWatcher watcher(view.get(), shown, meter, recorder, stop);
  const RunLog log = live(options, images, twists.get(), &watcher);
  const Metrics metrics = meter.result(log);
  finish(arguments, log, metrics, recorder);
  return foundNothing(log, metrics) ? kOtherOutcome : kMet;
}

}  // namespace

void addLive(CLI::App& app, int& exitCode) {
  CLI::App* command =
      app.add_subcommand("live", "Observe depth while a camera runs, or a video file");
  auto a = std::make_shared<LiveArguments>();
  command
      ->add_option(
          "--source", a->source,
          "Camera (0, /dev/video0, rtsp://...), video file, images (DIR/%06d.png), or pipe of PGM")
      ->required()
      ->type_name("SOURCE");
  command->add_option("--camera", a->camera, "camera_info file of this camera")->type_name("FILE");
  command
      ->add_option("--target", a->target,
                   "YAML file with 'target: {...}', 'dots: [...]' or both, as in sequence.yaml")
      ->type_name("FILE");
  command
      ->add_option(
          "--tracker", a->tracker,
          "dots | apriltag | chessboard | charuco | klt; default: the target's, klt without "
          "a target")
      ->type_name("NAME");
  command
      ->add_option("--twist", a->twist,
                   "Pipe (or file, or - for stdin) of lines timestamp,vx,vy,vz,wx,wy,wz")
      ->type_name("FIFO");
  addCameraInBase(*command, a->cameraInBase);
  command->add_option("--motion", a->motion, "twist | target; default: twist if --twist is given")
      ->type_name("SOURCE");
  addEstimatorOption(*command, a->observation);
  addObservationOptions(*command, a->observation);
  command->add_option("--fps", a->video.fps, "Images per second of a file; asked of a camera [Hz]")
      ->type_name("F")
      ->check(aboveZero());
  command->add_option("--start", a->video.start_s, "Time of a file's first image [s]; default 0")
      ->type_name("T");
  command->add_option("--times", a->times, "Times of a file's images, one per line, e.g. rgb.txt")
      ->type_name("FILE");
  command
      ->add_option("--latency", a->video.latency_s,
                   "Age of a camera's image when it arrives [s]; default 0")
      ->type_name("S")
      ->check(within(0.0, 10.0));
  command
      ->add_option("--patience", a->patience_s,
                   "How long an image waits for its twists [s]; default: camera 0.1, file 2")
      ->type_name("S")
      ->check(within(0.0, 60.0));
  command->add_option("--duration", a->duration_s, "Stop after this time [s]; default: at the end")
      ->type_name("S")
      ->check(aboveZero());
  addRecordingOptions(*command, a->files);
  command->add_flag("--no-window", a->noWindow, "Open no window");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->add_option("--out", a->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  command->callback([a, &exitCode] { exitCode = watchLive(*a); });
}

}  // namespace depthservo
