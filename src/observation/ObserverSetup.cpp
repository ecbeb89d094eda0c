#include "observation/ObserverSetup.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "depthservo/depth/DepthGains.h"
#include "depthservo/observation/words.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "observation/errorsOf.h"
#include "observation/makeTracker.h"
#include "sequence/rowMeanings.h"
#include "text/Names.h"

namespace depthservo {
namespace {

/// Unless declared otherwise, the observer takes odometry for exact and the filters have their own
/// default.
OdometryNoise noiseOf(const ObservationOptions& options) {
  if (errorKindOf(options) == ErrorKind::exact) return OdometryNoise::none();
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

void requireTruth(const ObservedSource& source) {
  if (source.hasTruth) return;
  throw InputError(
      {source.place, 0, ""},
      "the estimator 'true' is told the true depths: needs truth.csv; use constant, or "
      "let them be observed");
}

/// \param what needs the target in the images
void requireTracked(const ObservedSource& source, TrackerKind tracker, const char* what) {
  if (!findsPoints(source.target, tracker)) return;
  throw InputError({source.place, 0, ""},
                   fmt::format("{} needs the points of the target, which --tracker {} does not "
                               "follow",
                               what, toString(tracker)));
}

void requireGains(const ObservedSource& source, const ObserverGainOptions& gains) {
  if (!gains.k_3 || !(source.fastestRate > 0)) return;
  const std::string objection =
      DepthGains::objection(*gains.k_3, kGainExcitation, source.fastestRate);
  if (objection.empty()) return;
  throw InputError({source.settings.empty() ? source.place : source.settings, 0, "replay.k_3"},
                   objection);
}

const std::vector<detail::Choice<MotionSource>>& motionWords() {
  static const std::vector<detail::Choice<MotionSource>> all = {
      {MotionSource::twist, "twist"},
      {MotionSource::groundtruth, "groundtruth"},
      {MotionSource::target, "target"},
      {MotionSource::automatic, "auto"}};
  return all;
}

}  // namespace

MotionSource motionNamed(const std::string& name, const InputError::Place& place) {
  if (const auto source = detail::valueOf(motionWords(), name)) return *source;
  throw InputError(place, detail::unknownWord(name, detail::wordsOf(motionWords())));
}

RowMeaning rowMeaningNamed(const std::string& name, const InputError::Place& place) {
  if (const auto meaning = detail::valueOf(detail::rowMeanings(), name)) return *meaning;
  throw InputError(place, detail::unknownWord(name, detail::wordsOf(detail::rowMeanings())));
}

ObservedSource ObservedSource::of(const Sequence& sequence) {
  ObservedSource source{sequence.folder(), sequence.settingsFile(), sequence.camera(),
                        sequence.seen()};
  source.hasImages = sequence.hasImages();
  source.rows = source.target.rows.value_or(RowMeaning::hold);
  source.odometryRows =
      std::max({sequence.frames().size(), sequence.odometry().size(), sequence.poses().size()});
  std::set<int> ids;
  std::vector<double> periods;
  for (std::size_t k = 0; k < sequence.frames().size(); ++k) {
    for (const PixelPoint& point : sequence.frames()[k].tracks) ids.insert(point.id);
    source.hasTruth = source.hasTruth || !sequence.frames()[k].truth.empty();
    if (k > 0) periods.push_back(sequence.frames()[k].time_s - sequence.frames()[k - 1].time_s);
  }
  source.ids.assign(ids.begin(), ids.end());
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
  if (options.depth.estimator == EstimatorKind::trueDepth) {
    requireTruth(source);
    requireTracked(source, options.tracker, "the estimator 'true'");
  }
  EstimatorSetup setup{options.depth, noiseOf(options), options.odometryScaleSigma,
                       source.target.target};
  if (source.frameRate > 0) setup.frameRate = source.frameRate;
  setup.sigma = options.pixelNoise_px / source.camera.focal_px();
  setup.focalSigma = options.focalSigma;
  setup.errors = errorsOf(options);
  setup.camera = source.camera;
  return setup;
}

ObservationOptions withTracker(const ObservedSource& source, ObservationOptions options) {
  options.tracker = chooseTracker(source, options.tracker);
  return options;
}

ObserverSetup ObserverSetup::of(const ObservedSource& source, const ObservationOptions& asked) {
  const ObservationOptions options = withTracker(source, asked);
  ObserverSetup setup;
  setup.camera = source.camera;
  setup.pixelNoise_px = options.pixelNoise_px;
  setup.estimator = setupOf(source, options);
  setup.profile = toString(errorKindOf(options));
  setup.isPixelNoiseGiven = options.isPixelNoiseGiven;
  setup.learnsNoise = options.motion != MotionSource::target && setup.estimator.errors &&
                      errorKindOf(options) == ErrorKind::poses;
  setup.prior = options.prior();
  setup.declaredNoise = options.odometryNoise.value_or(OdometryNoise());
  setup.tracker = makeTracker(source.target, options.tracker, options);
  setup.takesTrackersNoise = measuresNoise(options.tracker) && !options.isPixelNoiseGiven;
  const bool hasDots = !source.target.dots.empty() || !source.target.target.points.empty();
  setup.noun = options.tracker == TrackerKind::klt ? "point"
               : source.target.hasCorners()        ? "corner"
               : hasDots                           ? "dot"
                                                   : "point";
  setup.ids = source.ids;
  if (options.tracker == TrackerKind::apriltag) setup.tags = tagsOf(source.target, options);
  if (depthservo::findsPoints(source.target, options.tracker)) {
    constexpr std::size_t kMostTagCorners = 4 * 64;
    setup.capacity = std::max(kMostTagCorners, static_cast<std::size_t>(options.corners));
  } else if (options.tracker != TrackerKind::tracks) {
    setup.ids = idsOf(source.target, options.tracker);
  }
  if (options.motion == MotionSource::target) setup.followed = source.target.target;
  setup.odometryRows = source.odometryRows;
  setup.rowPeriod_s = source.rowPeriod_s;
  if (options.motion == MotionSource::twist || options.motion == MotionSource::automatic) {
    setup.rows = options.rows.value_or(source.rows);
  }
  return setup;
}

std::string configurationOf(const ObservationOptions& options) {
  nlohmann::ordered_json json{{"tracker", toString(options.tracker)},
                              {"motion", detail::wordOf(motionWords(), options.motion)},
                              {"estimator", toString(options.depth.estimator)},
                              {"errors", toString(errorKindOf(options))},
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
