#include "depthservo/servo/Replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "servo/ImageObserver.h"
#include "servo/ObservationSetup.h"
#include "servo/Stopwatch.h"
#include "servo/makeTracker.h"
#include "servo/unexcited.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

[[noreturn]] void refuse(const Sequence& sequence, const std::string& message) {
  throw InputError({sequence.folder(), 0, ""}, message);
}

ReplayMotion chooseMotion(const Sequence& sequence, ReplayMotion wanted) {
  const bool hasTwist = !sequence.odometry().empty();
  const bool hasPoses = sequence.poses().size() > 1;
  const bool hasTarget = sequence.target().points.size() >= 4;
  if (wanted == ReplayMotion::automatic) {
    wanted = hasTwist   ? ReplayMotion::twist
             : hasPoses ? ReplayMotion::groundtruth
                        : ReplayMotion::target;
    if (wanted == ReplayMotion::target && !hasTarget) {
      refuse(sequence,
             "the camera's motion is unknown: needs twist.csv, ground truth (groundtruth.txt, "
             "*.gt.freiburg or mav0/state_groundtruth_estimate0/data.csv) or a target of at least "
             "four points in sequence.yaml");
    }
  }
  if (wanted == ReplayMotion::twist && !hasTwist)
    refuse(sequence, "--motion twist needs twist.csv");
  if (wanted == ReplayMotion::groundtruth && !hasPoses) {
    refuse(sequence,
           "--motion groundtruth needs ground truth with at least two poses (groundtruth.txt, "
           "*.gt.freiburg or mav0/state_groundtruth_estimate0/data.csv)");
  }
  if (wanted == ReplayMotion::target && !hasTarget) {
    refuse(sequence, "--motion target needs a target of at least four points in sequence.yaml");
  }
  return wanted;
}

/// Every id in tracks.csv, ascending.
std::vector<int> idsOfTracks(const Sequence& sequence) {
  std::set<int> ids;
  for (const SequenceFrame& frame : sequence.frames()) {
    for (const PixelPoint& point : frame.tracks) ids.insert(point.id);
  }
  return {ids.begin(), ids.end()};
}

ReplayOptions chosen(const Sequence& sequence, ReplayOptions options) {
  options.tracker = chooseTracker(sequence, options.tracker);
  options.motion = chooseMotion(sequence, options.motion);
  return options;
}

/// One replay under way.
class Replayer {
 public:
  Replayer(const Sequence& sequence, const ReplayOptions& options)
      : sequence_(sequence), options_(chosen(sequence, options)), observer_(parts()) {
    if (options_.motion == ReplayMotion::twist) offer(sequence.odometry());
    if (options_.motion == ReplayMotion::groundtruth) {
      offer(odometryFromPoses(sequence.poses()));
      gaps_ = gapsOf(sequence.poses());
    }
    log_.command = "replay";
    log_.name = sequence.name();
    log_.camera = sequence.camera();
    log_.configuration = configurationOf(options_);
  }

  RunLog run(const std::function<void(double)>& progress) {
    const std::size_t count = sequence_.frames().size();
    for (std::size_t k = 0; k < count; ++k) {
      log_.frames.push_back(frame(k));
      for (Event& event : observer_.takeEvents()) log_.events.push_back(std::move(event));
      if (progress) progress(static_cast<double>(k + 1) / static_cast<double>(count));
    }
    observer_.finish(log_);
    log_.timings.emplace(log_.timings.begin(), "image", std::move(imageTimes_));
    return std::move(log_);
  }

 private:
  ImageObserver::Parts parts() const {
    ImageObserver::Parts parts = partsOf(ObservedSource::of(sequence_), options_);
    if (options_.tracker == ReplayTracker::tracks) parts.ids = idsOfTracks(sequence_);
    parts.odometryCapacity = std::max(
        {sequence_.frames().size(), sequence_.odometry().size(), sequence_.poses().size()});
    return parts;
  }

  void offer(const std::vector<OdometryRow>& rows) {
    for (const OdometryRow& row : rows) observer_.offer(row);
  }

  FrameRecord frame(std::size_t k) {
    const SequenceFrame& source = sequence_.frames()[k];
    ImageObserver::Input input;
    input.time_s = source.time_s;
    input.tracks = &source.tracks;
    input.truth = &source.truth;
    input.isMotionKnown = isMotionKnown(source.time_s);
    vpImage<unsigned char> image;
    if (options_.tracker != ReplayTracker::tracks) {
      Stopwatch watch;
      image = sequence_.readImage(k);
      imageTimes_.push_back(watch.lap());
      input.image = &image;
      if (k == 0 || k + 1 == sequence_.frames().size()) {
        log_.images.emplace_back(
            k == 0 ? "first" : "last",
            std::vector<unsigned char>(image.bitmap, image.bitmap + image.getSize()));
      }
    }
    const std::optional<DepthMap> depth = sequence_.readDepth(k);
    if (depth) input.depth = &*depth;
    return observer_.observe(input);
  }

  /// Far from any pose nobody knows where the camera was, as the data sets' own tools have it.
  bool isMotionKnown(double time_s) {
    for (const TimeSpan& gap : gaps_) {
      if (std::min(time_s - gap.from_s, gap.to_s - time_s) < kFarFromPose_s) continue;
      if (noted_ != &gap) {
        noted_ = &gap;
        log_.events.push_back({time_s, fmt::format("no pose for {:.3g} s: images are not used",
                                                   gap.to_s - gap.from_s)});
      }
      return false;
    }
    return true;
  }

  static constexpr double kFarFromPose_s = 0.02;  // as in associate.py

  const Sequence& sequence_;
  ReplayOptions options_;  // tracker and motion chosen
  ImageObserver observer_;
  std::vector<TimeSpan> gaps_;
  const TimeSpan* noted_ = nullptr;
  std::vector<double> imageTimes_;  // of reading [s]
  RunLog log_;
};

}  // namespace

DepthPrior ReplayOptions::prior() const {
  DepthPrior prior{depth.initial};
  if (priorSigma_Z) prior.sigma_chi = *priorSigma_Z / (prior.Z * prior.Z);
  return prior;
}

ReplayOptions ReplayOptions::of(const Sequence& sequence) {
  return of(sequence.replayHints(), sequence.folder() + "/sequence.yaml");
}

ReplayOptions ReplayOptions::of(const ReplayHints& hints, const std::string& file) {
  ReplayOptions options;
  if (hints.estimator) {
    options.depth.estimator = availableEstimator(*hints.estimator, {file, 0, "replay.estimator"});
  }
  options.depth.initial = hints.prior.value_or(options.depth.initial);
  options.pixelNoise_px = hints.pixel_noise.value_or(options.pixelNoise_px);
  options.isPixelNoiseGiven = hints.pixel_noise.has_value();
  if (const auto& noise = hints.odometry_noise) {
    options.odometryNoise =
        noise->isZero() ? OdometryNoise::none()
                        : OdometryNoise::white((*noise)[0], (*noise)[1], hints.odometry_mode);
  }
  options.odometryScaleSigma = hints.odometry_scale_sigma.value_or(options.odometryScaleSigma);
  options.focalSigma = hints.focal_sigma.value_or(options.focalSigma);
  if (const auto& joint = hints.joint) {
    options.depth.joint = {joint->time_offset, joint->gyro_bias, joint->focal};
  }
  options.depth.Z_min = hints.Z_min.value_or(options.depth.Z_min);
  options.depth.Z_max = hints.Z_max.value_or(options.depth.Z_max);
  options.depth.gains.settling = hints.settling.value_or(options.depth.gains.settling);
  options.depth.gains.W_min = hints.W_min.value_or(options.depth.gains.W_min);
  options.depth.gains.k = hints.k;
  options.depth.pose.ke = hints.ke;
  options.depth.pose.kappa = hints.kappa.value_or(options.depth.pose.kappa);
  options.depth.gains.k_3 = hints.k_3;
  return options;
}

RunLog replay(const Sequence& sequence, const ReplayOptions& options,
              const std::function<void(double)>& progress) {
  RunLog log = Replayer(sequence, options).run(progress);
  addUnexcitedEvents(log);
  return log;
}

}  // namespace depthservo
