#include "observation/ObservationSetup.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "depthservo/depth/DepthGains.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "observation/makeTracker.h"

namespace depthservo {
namespace {

/// Unless declared otherwise, the observer takes odometry for exact and the filters have their own
/// default.
OdometryNoise noiseOf(const ObservationOptions& options) {
  if (options.odometryNoise) return *options.odometryNoise;
  return options.depth.estimator == EstimatorKind::nonlinear ? OdometryNoise::none()
                                                             : OdometryNoise();
}

void requireTarget(const ObservedSource& source) {
  const auto why = whyNoTarget(source.target.target.points);
  if (!why) return;
  throw InputError({source.place, 0, ""},
                   fmt::format("the estimator 'pose' needs a known target: {}; give "
                               "'target: {{type: dots, points: [...]}}' in {}",
                               *why,
                               source.settings.empty()
                                   ? "a file for --target"
                                   : std::filesystem::path(source.settings).filename().string()));
}

/// \param what needs the target in the images
void requireTracked(const ObservedSource& source, TrackerKind tracker, const char* what) {
  if (!findsPoints(source.target, tracker)) return;
  throw InputError({source.place, 0, ""},
                   fmt::format("{} needs the points of the target, which --tracker {} does not "
                               "follow",
                               what, nameOf(tracker)));
}

void requireGains(const ObservedSource& source, const ObserverGainOptions& gains) {
  if (!gains.k_3 || !(source.fastestRate > 0)) return;
  const std::string objection =
      DepthGains::objection(*gains.k_3, kGainExcitation, source.fastestRate);
  if (objection.empty()) return;
  throw InputError({source.settings.empty() ? source.place : source.settings, 0, "replay.k_3"},
                   objection);
}

const char* nameOf(MotionSource motion) {
  switch (motion) {
    case MotionSource::twist:
      return "twist";
    case MotionSource::groundtruth:
      return "groundtruth";
    default:
      return "target";
  }
}

}  // namespace

ObservedSource ObservedSource::of(const Sequence& sequence) {
  ObservedSource source{sequence.folder(), sequence.folder() + "/sequence.yaml", sequence.camera(),
                        targetOf(sequence)};
  std::vector<double> periods;
  for (std::size_t k = 1; k < sequence.frames().size(); ++k) {
    periods.push_back(sequence.frames()[k].time_s - sequence.frames()[k - 1].time_s);
  }
  if (periods.empty()) return source;
  std::sort(periods.begin(), periods.end());
  source.frameRate = 1 / periods[periods.size() / 2];
  source.fastestRate = 1 / periods.front();
  return source;
}

EstimatorSetup setupOf(const ObservedSource& source, const ObservationOptions& options) {
  requireGains(source, options.depth.gains);
  if (options.motion == MotionSource::target) {
    requireTracked(source, options.tracker, "--motion target");
  }
  if (options.depth.estimator == EstimatorKind::pose) {
    requireTarget(source);
    requireTracked(source, options.tracker, "the estimator 'pose'");
  }
  EstimatorSetup setup{options.depth, noiseOf(options), options.odometryScaleSigma,
                       source.target.target};
  if (source.frameRate > 0) setup.frameRate = source.frameRate;
  setup.sigma = options.pixelNoise_px / source.camera.focal_px();
  setup.focalSigma = options.focalSigma;
  return setup;
}

ImageObserver::Parts partsOf(const ObservedSource& source, const ObservationOptions& options) {
  ImageObserver::Parts parts;
  parts.camera = source.camera;
  parts.pixelNoise_px = options.pixelNoise_px;
  parts.prior = options.prior();
  parts.estimator = setupOf(source, options);
  parts.declaredNoise = options.odometryNoise.value_or(OdometryNoise());
  putTracker(parts, source.target, options.tracker, options);
  if (options.motion == MotionSource::target) parts.followed = source.target.target;
  return parts;
}

std::string configurationOf(const ObservationOptions& options) {
  nlohmann::ordered_json json{{"tracker", nameOf(options.tracker)},
                              {"motion", nameOf(options.motion)},
                              {"estimator", toString(options.depth.estimator)},
                              {"prior_Z", options.depth.initial},
                              {"prior_sigma_Z", nullptr},
                              {"pixel_noise", nullptr},
                              {"odometry_noise", nullptr},
                              {"odometry_scale_sigma", options.odometryScaleSigma},
                              {"focal_sigma", options.focalSigma},
                              {"Z_min", options.depth.Z_min},
                              {"Z_max", options.depth.Z_max}};
  if (options.priorSigma_Z) json["prior_sigma_Z"] = *options.priorSigma_Z;
  if (options.isPixelNoiseGiven || !measuresNoise(options.tracker)) {
    json["pixel_noise"] = options.pixelNoise_px;
  }
  if (const auto& noise = options.odometryNoise) {
    json["odometry_noise"] = {noise->sigma_v, noise->sigma_w};
  }
  if (options.depth.estimator == EstimatorKind::joint) {
    const JointStateOptions& joint = options.depth.joint;
    json["joint"] = {
        {"time_offset", joint.time_offset}, {"gyro_bias", joint.gyro_bias}, {"focal", joint.focal}};
  }
  return json.dump();
}

}  // namespace depthservo
