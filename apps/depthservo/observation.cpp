#include "observation.h"

#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>

#include "depthservo/servo/Metrics.h"

namespace depthservo {
namespace {

/// Z or Z:sigma in metres.
void readPrior(const std::string& text, ReplayOptions& options) {
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

}  // namespace

void refuseOption(const std::string& option, const std::string& message) {
  throw InputError({option, 0, ""}, message);
}

void addObservationOptions(CLI::App& command, ObservationArguments& a) {
  command
      .add_option("--estimator", a.estimator,
                  "constant | two-frame | nonlinear | window | filter (default) | joint")
      ->type_name("NAME");
  command.add_option("--ke", a.ke, "Gain of the estimator pose [1/s]; default: by the frame rate")
      ->type_name("KE")
      ->check(CLI::PositiveNumber);
  command.add_option("--prior", a.prior, "First guess of every depth [m], with its sigma if known")
      ->type_name("Z[:SIGMA]");
  command.add_option("--pixel-noise", a.pixelNoise_px, "1 sigma per axis [px]; default 0.5")
      ->type_name("PX")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--odometry-noise", a.odometryNoise,
                  "White noise per twist row, 1 sigma [m/s],[rad/s]; 0,0: exact")
      ->type_name("V,W")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--odometry-scale-sigma", a.odometryScaleSigma,
                  "Relative uncertainty of the translation, 1 sigma; for filter and joint")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
}

void apply(const ObservationArguments& arguments, ReplayOptions& options) {
  if (!arguments.estimator.empty()) {
    options.depth.estimator = availableEstimator(arguments.estimator, {"--estimator", 0, ""});
  }
  if (options.depth.estimator == EstimatorKind::trueDepth) {
    refuseOption("--estimator",
                 "'true' is for simulated runs; use constant, or let it be observed");
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
}

ReplayTracker trackerNamed(const std::string& name) {
  if (name == "auto") return ReplayTracker::automatic;
  if (name == "dots") return ReplayTracker::dots;
  if (name == "tracks") return ReplayTracker::tracks;
  if (name == "apriltag" || name == "klt") {
    refuseOption("--tracker", fmt::format("'{}' is not in this version; use dots or tracks", name));
  }
  refuseOption("--tracker", fmt::format("'{}' is not known; expected dots or tracks", name));
}

void silenceImageLibraries() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
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

}  // namespace depthservo
