#include "observation.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/core/utils/logger.hpp>

#include "TagLines.h"
#include "depthservo/observation/words.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/observationOf.h"
#include "numbers.h"

namespace depthservo {
namespace {

/// Z or Z:sigma in metres.
void readPrior(const std::string& text, ObservationOptions& options) {
  const auto number = [&](const std::string& part) {
    double value = 0;
    if (!CLI::detail::lexical_cast(part, value) || !(value > 0) || !std::isfinite(value)) {
      refuseOption("--prior",
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

/// What the joint filter shall learn besides depths.
JointStateOptions jointNamed(const std::vector<std::string>& names) {
  JointStateOptions joint{false, false, false};
  for (const std::string& name : names) {
    if (name == "time-offset") {
      joint.time_offset = true;
    } else if (name == "gyro-bias") {
      joint.gyro_bias = true;
    } else if (name == "focal") {
      joint.focal = true;
    } else if (name != "none") {
      refuseWord("--joint", name, {"time-offset", "gyro-bias", "focal", "none"});
    } else if (names.size() > 1) {
      refuseOption("--joint", "none stands alone");
    }
  }
  return joint;
}

double median(std::vector<double> values) {
  if (values.empty()) return kUnknown;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// So many points that only their statistics can be read.
void printStatistics(const Metrics& metrics) {
  std::vector<double> Z, sigma, error;
  std::map<DepthStatus, int> count;
  for (const PointMetrics& point : metrics.points) {
    ++count[point.status];
    if (point.status != DepthStatus::valid) continue;
    Z.push_back(point.Z);
    sigma.push_back(point.sigma_Z / point.Z);
    if (std::isfinite(point.relative_error)) error.push_back(point.relative_error);
  }
  std::string statuses;
  for (const auto& [status, n] : count) {
    statuses += fmt::format("{}{} {}", statuses.empty() ? "" : ", ", n, toString(status));
  }
  fmt::print(stderr, "  {} points at the end: {}; {} more came and went\n", metrics.points.size(),
             statuses, metrics.points_gone());
  if (!Z.empty()) {
    fmt::print(stderr, "  valid: median Z {:.3g} m, median sigma {}", median(Z),
               inPercent(median(sigma)));
    if (!error.empty()) fmt::print(stderr, ", median error {}", inPercent(median(error)));
    fmt::print(stderr, "\n");
  }
}

/// Two sigma are more than the depth itself: its number says nothing.
bool isNotKnown(const PointMetrics& point, bool isObserved) {
  return isObserved && !(point.known_to() < 1);
}

/// How well the depth is known, and what happens to it at the end.
std::string knowledge(const PointMetrics& point, bool isObserved) {
  const bool isHeld = point.status == DepthStatus::unexcited;
  if (!isObserved && (isHeld || point.status == DepthStatus::valid)) {
    return fmt::format("Z {:.4g} +- {:.2g} m (2 sigma), as given", point.Z, 2 * point.sigma_Z);
  }
  const bool isKnown = !isNotKnown(point, isObserved);
  std::string text = isKnown ? fmt::format("Z {:.4g} +- {:.2g} m (2 sigma), known to {}", point.Z,
                                           2 * point.sigma_Z, inPercent(point.known_to()))
                             : "Z is not known";
  const bool isHidden = point.status == DepthStatus::coasting || point.status == DepthStatus::lost;
  if (isHidden && std::isfinite(point.last_valid_s)) {
    return text +
           fmt::format(", {}, valid until {:.3f} s", toString(point.status), point.last_valid_s);
  }
  if (isHeld && isKnown) return text + ", kept: not excited now";
  return text + fmt::format(", {}", toString(point.status));
}

void printPoint(const PointMetrics& point, const RunLog& log) {
  fmt::print(stderr, "  point {}: {}, measured in {} frames", point.id,
             knowledge(point, log.isDepthObserved), point.measured_frames);
  if (std::isfinite(point.relative_error) && !isNotKnown(point, log.isDepthObserved)) {
    fmt::print(stderr, ", {} from {:.4g} m{}", inPercent(point.relative_error), point.Z_true,
               log.isTruthOfMotion ? " by the pose that told the motion" : "");
  }
  const bool isMotionRight = !log.diagnosis || !log.diagnosis->isMotion();
  if (isMotionRight && point.status == DepthStatus::unexcited && !point.unexcited_because.empty()) {
    fmt::print(stderr, ": {}", point.unexcited_because);
  }
  fmt::print(stderr, "\n");
}

}  // namespace

void refuseOption(const std::string& option, const std::string& message) {
  throw InputError({option, 0, ""}, message);
}

void refuseWord(const std::string& option, const std::string& word,
                const std::vector<std::string>& valid) {
  refuseOption(option, fmt::format("'{}' is not known; expected {}; the nearest is '{}'", word,
                                   fmt::join(valid, ", "), nearestWord(word, valid)));
}

void addEstimatorOption(CLI::App& command, ObservationArguments& a) {
  command
      .add_option("--estimator", a.estimator,
                  "constant | two-frame | nonlinear | window | filter (default) | joint | pose")
      ->type_name("NAME");
}

void addObservationOptions(CLI::App& command, ObservationArguments& a) {
  command.add_option("--ke", a.ke, "Gain of the estimator pose [1/s]; default: by the frame rate")
      ->type_name("KE")
      ->check(aboveZero());
  command.add_option("--prior", a.prior, "First guess of every depth [m], with its sigma if known")
      ->type_name("Z[:SIGMA]");
  command
      .add_option("--tag-family", a.tagFamily,
                  "Family of AprilTags that the target does not name; default 36h11")
      ->type_name("NAME");
  command
      .add_option("--corners", a.corners, "Corners that klt follows at once, at most; default 300")
      ->type_name("N")
      ->check(within(1, 2000));
  command
      .add_option("--pixel-noise", a.pixelNoise_px,
                  "Noise of a point, 1 sigma per axis [px]; default 0.5, of trackers but dots "
                  "what they measure")
      ->type_name("PX")
      ->check(aboveZero());
  command
      .add_option("--odometry-noise", a.odometryNoise,
                  "White noise per twist row, 1 sigma [m/s],[rad/s]; 0,0: exact")
      ->type_name("V,W")
      ->delimiter(',')
      ->expected(2)
      ->check(zeroOrMore());
  command
      .add_option("--rows", a.rows,
                  "What a row of twists is: hold (mean until the next row) | instant (a sample) | "
                  "mean-before (mean since the row before; default of streams); default: as "
                  "sequence.yaml has it, hold")
      ->type_name("MEANING");
  command
      .add_option(
          "--errors", a.errors,
          "Errors of the robot: typical (default) | poses (default where the motion is from "
          "poses) | arm | declared (default with --odometry-noise) | exact")
      ->type_name("PROFILE");
  command
      .add_option("--odometry-scale-sigma", a.odometryScaleSigma,
                  "Relative uncertainty of the translation, 1 sigma; for filter and joint")
      ->type_name("S")
      ->check(zeroOrMore());
  command
      .add_option("--focal-sigma", a.focalSigma,
                  "Relative uncertainty of the focal length, 1 sigma; for filter and joint")
      ->type_name("S")
      ->check(zeroOrMore());
  command
      .add_option("--joint", a.joint,
                  "What the joint filter learns besides depths: time-offset,gyro-bias,focal or "
                  "none; default time-offset")
      ->type_name("LIST")
      ->delimiter(',');
}

void apply(const ObservationArguments& arguments, bool hasTags, ObservationOptions& options) {
  if (!arguments.estimator.empty()) {
    options.depth.estimator = estimatorNamed(arguments.estimator, {"--estimator", 0, ""});
  }
  if (!arguments.joint.empty()) {
    if (arguments.estimator.empty()) options.depth.estimator = EstimatorKind::joint;
    if (options.depth.estimator != EstimatorKind::joint) {
      refuseOption("--joint", "is for --estimator joint");
    }
    options.depth.joint = jointNamed(arguments.joint);
    if (arguments.errors.empty()) options.depth.errors = ErrorKind::declared;
  }
  if (arguments.ke) options.depth.pose.ke = arguments.ke;
  if (!arguments.prior.empty()) readPrior(arguments.prior, options);
  if (arguments.odometryNoise.size() == 2) {
    const double sigma_v = arguments.odometryNoise[0], sigma_w = arguments.odometryNoise[1];
    options.odometryNoise = sigma_v == 0 && sigma_w == 0 ? OdometryNoise::none()
                                                         : OdometryNoise::white(sigma_v, sigma_w);
  }
  if (!arguments.errors.empty()) {
    const auto kind = errorKindNamed(arguments.errors);
    if (kind) {
      options.depth.errors = *kind;
    } else if (std::filesystem::exists(arguments.errors)) {
      options.depth.errors = ErrorKind::file;
      options.depth.profile = readErrorProfile(arguments.errors);
    } else {
      refuseWord("--errors", arguments.errors, errorKindNames());
    }
  }
  if (!arguments.rows.empty()) options.rows = rowMeaningNamed(arguments.rows, {"--rows", 0, ""});
  if (arguments.odometryScaleSigma) options.odometryScaleSigma = *arguments.odometryScaleSigma;
  if (arguments.focalSigma) options.focalSigma = *arguments.focalSigma;
  if (!arguments.tagFamily.empty()) {
    const std::vector<std::string> families = aprilTagFamilies();
    if (std::find(families.begin(), families.end(), arguments.tagFamily) == families.end()) {
      refuseWord("--tag-family", arguments.tagFamily, families);
    }
    if (hasTags) refuseOption("--tag-family", "the target names its tags already");
    options.tagFamily = arguments.tagFamily;
  }
  if (arguments.corners > 0) options.corners = arguments.corners;
  if (arguments.pixelNoise_px > 0) {
    options.pixelNoise_px = arguments.pixelNoise_px;
    options.isPixelNoiseGiven = true;
  }
}

void addCameraInBase(CLI::App& command, std::optional<RpyPose>& cameraInBase) {
  command
      .add_option_function<std::vector<double>>(
          "--camera-in-base",
          [&cameraInBase](const std::vector<double>& values) {
            cameraInBase =
                RpyPose{{values[0], values[1], values[2]}, {values[3], values[4], values[5]}};
          },
          "Place of the camera (z forward, x right) in the base whose twists the rows are [m, "
          "rad]: they become the camera's; default: rows are the camera's, of a bag by its "
          "transforms")
      ->type_name("X,Y,Z,ROLL,PITCH,YAW")
      ->delimiter(',')
      ->expected(6);
}

void addSourceOptions(CLI::App& command, SequenceOptions& source) {
  command
      .add_option(
          "--camera", source.camera,
          "camera_info or EuRoC sensor.yaml, or tum-fr1 | tum-fr2 | tum-fr3 | icl; default: "
          "camera.yaml, of a bag its camera_info")
      ->type_name("FILE");
  command
      .add_option("--fps", source.fps,
                  "Images per second of a plain image folder, or of frame numbers")
      ->type_name("F")
      ->check(aboveZero());
  command
      .add_option("--topics", source.topics,
                  "Of a bag: image=/camera/image_raw,odometry=/odom and camera_info=, poses=; "
                  "odometry=/cmd_vel@base_link names the frame; odometry=none; default: the only "
                  "one of each kind")
      ->type_name("ROLE=TOPIC,..")
      ->delimiter(',');
  addCameraInBase(command, source.cameraInBase);
  command
      .add_option("--target", source.target,
                  "YAML file with 'target: {...}', 'dots: [...]' or both, instead of those of "
                  "sequence.yaml")
      ->type_name("FILE");
}

void addSequenceOptions(CLI::App& command, SequenceArguments& a) {
  command
      .add_option("--tracker", a.tracker,
                  "dots | apriltag | chessboard | charuco | klt | tracks; default: the target's, "
                  "dots where "
                  "there are images")
      ->type_name("NAME");
  command
      .add_option("--motion", a.motion,
                  "twist | groundtruth | target; default: the first that the sequence has")
      ->type_name("SOURCE");
  addSourceOptions(command, a.source);
  addObservationOptions(command, a.observation);
}

ObservationOptions optionsOf(const SequenceArguments& arguments, const Sequence& sequence) {
  ObservationOptions options = observationOf(sequence);
  options.tracker = trackerNamed(arguments.tracker, {"--tracker", 0, ""});
  options.motion = motionNamed(arguments.motion, {"--motion", 0, ""});
  apply(arguments.observation, sequence.tags().has_value(), options);
  return options;
}

void addRecordingOptions(CLI::App& command, RecordingFiles& files) {
  command
      .add_option("--mcap", files.mcap,
                  "Write images, depths, commands and events for Foxglove; must not exist")
      ->type_name("FILE");
  command
      .add_option("--tum", files.tum,
                  "Write the camera's trajectory as odometry has it, for evo; must not exist")
      ->type_name("FILE");
}

PinholeCamera requiredCamera(const std::string& name) {
  if (name.empty()) {
    refuseOption("--camera", "missing; give a camera_info file (doc/sources.md: how to calibrate)");
  }
  return loadCamera(name);
}

void silenceImageLibraries() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

void printTable(const RunLog& log, const Metrics& metrics) {
  fmt::print(stderr, "{}: {} frames, {:.2f} s\n", log.name, metrics.frames, metrics.duration_s);
  if (metrics.rejected_measurements > 0) {
    fmt::print(stderr, "  {} measurements rejected; {} points not to be relied on\n",
               metrics.rejected_measurements, metrics.rejected_points);
  }
  printTags(log);
  constexpr std::size_t kMostLines = 16;
  if (metrics.points.size() + metrics.points_gone() > kMostLines) return printStatistics(metrics);
  for (const PointMetrics& point : metrics.points) printPoint(point, log);
}

bool foundNothing(const RunLog& log, const Metrics& metrics) {
  if (metrics.points_seen > 0) return false;
  fmt::print(stderr,
             "{}: no point was found in any of the {} images: are tracker, target, tag family and "
             "start positions those of these images?\n",
             log.name, metrics.frames);
  return true;
}

}  // namespace depthservo
