#include "depthservo/servo/Replay.h"

#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <optional>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/servo/Baseline.h"
#include "depthservo/servo/FocalReplay.h"
#include "depthservo/servo/Metrics.h"
#include "depthservo/servo/RunFolder.h"
#include "findings.h"

namespace depthservo {
namespace {

struct ReplayArguments {
  std::string sequence, estimator, prior, baseline, out, tracker = "auto", motion = "auto";
  std::string observe = "depth";
  SequenceOptions source;
  double pixelNoise_px = 0;
  std::vector<double> odometryNoise, focalGains;
  std::optional<double> odometryScaleSigma, ke;
  bool update = false, json = false;
};

[[noreturn]] void refuse(const std::string& option, const std::string& message) {
  throw InputError({option, 0, ""}, message);
}

/// Z or Z:sigma in metres.
void readPrior(const std::string& text, ReplayOptions& options) {
  const auto number = [&](const std::string& part) {
    double value = 0;
    if (!CLI::detail::lexical_cast(part, value) || !(value > 0) || !std::isfinite(value)) {
      refuse("--prior",
             fmt::format("'{}' is not a depth; expected Z or Z:sigma in metres, both > 0, "
                         "e.g. 1.5 or 1.5:0.2",
                         text));
    }
    return value;
  };
  const std::size_t colon = text.find(':');
  options.depth.initial = number(text.substr(0, colon));
  if (colon != std::string::npos) options.priorSigma_Z = number(text.substr(colon + 1));
}

ReplayTracker trackerNamed(const std::string& name) {
  if (name == "auto") return ReplayTracker::automatic;
  if (name == "dots") return ReplayTracker::dots;
  if (name == "tracks") return ReplayTracker::tracks;
  if (name == "apriltag" || name == "klt") {
    refuse("--tracker", fmt::format("'{}' is not in this version; use dots or tracks", name));
  }
  refuse("--tracker", fmt::format("'{}' is not known; expected dots or tracks", name));
}

ReplayMotion motionNamed(const std::string& name) {
  if (name == "auto") return ReplayMotion::automatic;
  if (name == "twist") return ReplayMotion::twist;
  if (name == "groundtruth") return ReplayMotion::groundtruth;
  if (name == "target") return ReplayMotion::target;
  refuse("--motion", fmt::format("'{}' is not known; expected twist, groundtruth or target", name));
}

ReplayOptions optionsOf(const ReplayArguments& arguments, const Sequence& sequence) {
  ReplayOptions options = ReplayOptions::of(sequence);
  options.tracker = trackerNamed(arguments.tracker);
  options.motion = motionNamed(arguments.motion);
  if (arguments.observe != "depth" && arguments.observe != "focal") {
    refuse("--observe",
           fmt::format("'{}' is not known; expected depth or focal", arguments.observe));
  }
  if (!arguments.estimator.empty()) {
    options.depth.estimator = availableEstimator(arguments.estimator, {"--estimator", 0, ""});
  }
  if (options.depth.estimator == EstimatorKind::trueDepth) {
    refuse("--estimator", "'true' is for simulated runs; use constant, or let it be observed");
  }
  if (arguments.ke) options.depth.pose.ke = arguments.ke;
  if (!arguments.prior.empty()) readPrior(arguments.prior, options);
  if (arguments.odometryNoise.size() == 2) {
    const double sigma_v = arguments.odometryNoise[0], sigma_w = arguments.odometryNoise[1];
    options.odometryNoise = sigma_v == 0 && sigma_w == 0 ? OdometryNoise::none()
                                                         : OdometryNoise::white(sigma_v, sigma_w);
  }
  if (arguments.odometryScaleSigma) options.odometryScaleSigma = *arguments.odometryScaleSigma;
  if (arguments.pixelNoise_px > 0) options.pixelNoise_px = arguments.pixelNoise_px;
  return options;
}

void printTable(const RunLog& log) {
  const Metrics metrics = computeMetrics(log);
  fmt::print(stderr, "{}: {} frames, {:.2f} s\n", log.name, metrics.frames, metrics.duration_s);
  for (const PointMetrics& point : metrics.points) {
    fmt::print(stderr, "  point {}: Z {:.4g} +- {:.2g} m (2 sigma), {}, measured in {} frames",
               point.id, point.Z, 2 * point.sigma_Z, toString(point.status), point.measured_frames);
    if (std::isfinite(point.relative_error)) {
      fmt::print(stderr, ", {:.2g} % from {:.4g} m", 100 * point.relative_error, point.Z_true);
    }
    if (point.status == DepthStatus::unexcited && !point.unexcited_because.empty()) {
      fmt::print(stderr, ": {}", point.unexcited_because);
    }
    fmt::print(stderr, "\n");
  }
}

/// The exit code of comparing with a baseline, told on stderr.
int compare(const RunLog& log, const std::string& file, bool update) {
  Baseline now = Baseline::of(log);
  if (update) {
    if (std::filesystem::exists(file)) now.setTolerance(Baseline::load(file).tolerance());
    now.save(file);
    fmt::print(stderr, "baseline written: {}\n", file);
    return kMet;
  }
  const Baseline accepted = Baseline::load(file);
  const auto moved = accepted.differences(now);
  for (const Baseline::Difference& difference : moved) {
    fmt::print(stderr, "moved: {}: {} accepted, {} now\n", difference.figure, difference.accepted,
               difference.now);
  }
  if (moved.empty()) return kMet;
  fmt::print(stderr, "{} figures moved by more than {:g} (relative); accept with --update\n",
             moved.size(), accepted.tolerance());
  return kNotMet;
}

void printFocal(const FocalReplay& replay) {
  fmt::print(stderr, "{}: {} frames, {:.2f} s\n", replay.name, replay.frames, replay.duration_s);
  for (const FocalPoint& point : replay.points) {
    const FocalEstimate& e = point.estimate;
    fmt::print(stderr,
               "  point {}: focal length {:.5g} +- {:.2g} px (2 sigma), {}{}{}; eta1 {:.3g}, eta2 "
               "{:.3g} px rad/s, sigma_min {:.3g}; measured in {} frames\n",
               point.id, e.focal_px, 2 * e.sigma_focal_px, toString(e.status),
               point.unexcited_because.empty() ? "" : ": ", point.unexcited_because, e.eta1, e.eta2,
               e.sigma_min, point.measured_frames);
  }
  fmt::print(stderr, "focal length {:.5g} px, {}; the camera file says {:.6g} px\n",
             replay.focal_px, toString(replay.status), replay.camera.fx);
  fmt::print(stderr, "the camera is {:.3g} m ahead of the axis it turns about: ", replay.lever_m);
  if (replay.Z) {
    fmt::print(stderr, "without that, {:.5g} px for points at {:g} m\n", replay.compensated_px,
               *replay.Z);
  } else {
    fmt::print(stderr, "divide by 1 + {:.3g} m/Z, or give Z with --prior\n", replay.lever_m);
  }
}

int replayFocalLength(const ReplayArguments& arguments, const Sequence& sequence,
                      const ReplayOptions& options) {
  if (!arguments.baseline.empty()) refuse("--baseline", "is for --observe depth");
  FocalReplayOptions focal;
  focal.replay = options;
  if (!arguments.prior.empty()) focal.Z = options.depth.initial;
  if (arguments.focalGains.size() == 3) {
    focal.gains = {arguments.focalGains[0], arguments.focalGains[1], arguments.focalGains[2]};
  }
  FocalReplay result;
  {
    ProgressBar bar("replay " + sequence.name());
    result = replayFocal(sequence, focal, [&](double done) { bar.show(done); });
  }
  if (!arguments.out.empty()) writeFocalFolder(result, arguments.out);
  printFocal(result);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(result));
  return kMet;
}

int replaySequence(const ReplayArguments& arguments) {
  if (arguments.update && arguments.baseline.empty()) refuse("--update", "needs --baseline FILE");
  const Sequence sequence(arguments.sequence, arguments.source);
  const ReplayOptions options = optionsOf(arguments, sequence);
  if (!arguments.baseline.empty() && !arguments.update) Baseline::load(arguments.baseline);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);
  for (const std::string& warning : sequence.warnings()) fmt::print(stderr, "note: {}\n", warning);

  if (arguments.observe == "focal") return replayFocalLength(arguments, sequence, options);
  if (!arguments.focalGains.empty()) refuse("--focal-gains", "is for --observe focal");
  RunLog log;
  {
    ProgressBar bar("replay " + sequence.name());
    log = replay(sequence, options, [&](double done) { bar.show(done); });
  }
  if (!arguments.out.empty()) writeRunFolder(log, arguments.out);
  printTable(log);
  printFindings(log);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(log));
  return arguments.baseline.empty() ? kMet : compare(log, arguments.baseline, arguments.update);
}

}  // namespace

void addReplay(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("replay", "Observe depth on recorded data");
  auto a = std::make_shared<ReplayArguments>();
  command->add_option("SEQUENCE", a->sequence, "Folder: see doc/formats.md")->required();
  command
      ->add_option("--tracker", a->tracker, "dots | tracks; default: dots where there are images")
      ->type_name("NAME");
  command
      ->add_option("--estimator", a->estimator,
                   "constant | two-frame | nonlinear | window | filter (default) | joint")
      ->type_name("NAME");
  command->add_option("--ke", a->ke, "Gain of the estimator pose [1/s]; default: by the frame rate")
      ->type_name("KE")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--prior", a->prior, "First guess of every depth [m], with its sigma if known")
      ->type_name("Z[:SIGMA]");
  command
      ->add_option("--motion", a->motion,
                   "twist | groundtruth | target; default: the first that the sequence has")
      ->type_name("SOURCE");
  command->add_option("--pixel-noise", a->pixelNoise_px, "1 sigma per axis [px]; default 0.5")
      ->type_name("PX")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--odometry-noise", a->odometryNoise,
                   "White noise per twist row, 1 sigma [m/s],[rad/s]; 0,0: exact")
      ->type_name("V,W")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--odometry-scale-sigma", a->odometryScaleSigma,
                   "Relative uncertainty of the translation, 1 sigma; for filter and joint")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--camera", a->source.camera,
                   "camera_info file, or tum-fr1 | tum-fr2 | tum-fr3 | icl; default: camera.yaml")
      ->type_name("FILE");
  command->add_option("--fps", a->source.fps, "Images per second of a plain image folder")
      ->type_name("F")
      ->check(CLI::PositiveNumber);
  command->add_option("--observe", a->observe, "depth (default) | focal")->type_name("WHAT");
  command
      ->add_option("--focal-gains", a->focalGains,
                   "Gains of --observe focal, for pixels; default: for the motion at hand")
      ->type_name("K,K3,K4")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--baseline", a->baseline,
                   "Compare with accepted figures; exit 1 when one moved")
      ->type_name("FILE");
  command->add_flag("--update", a->update, "Accept the figures: write them to the baseline");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->add_option("--out", a->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  command->callback([a, &exitCode] { exitCode = replaySequence(*a); });
}

}  // namespace depthservo
