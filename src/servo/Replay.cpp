#include "depthservo/servo/Replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/tracking/KltTracker.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "depthservo/tracking/TargetPose.h"
#include "servo/FrameRateMonitor.h"
#include "servo/Stopwatch.h"
#include "servo/TagSizeMonitor.h"
#include "servo/expectedPoints.h"
#include "servo/makeEstimator.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

/// Of a sequence with one image [Hz].
constexpr double kUsualRate = 30;

[[noreturn]] void refuse(const Sequence& sequence, const std::string& message) {
  throw InputError({sequence.folder(), 0, ""}, message);
}

ReplayTracker chooseTracker(const Sequence& sequence, ReplayTracker wanted) {
  const bool canSeeDots = sequence.hasImages() && !sequence.tags() &&
                          (!sequence.dots().empty() || !sequence.target().points.empty());
  if (wanted == ReplayTracker::automatic && sequence.tags() && sequence.hasImages()) {
    return ReplayTracker::apriltag;
  }
  if ((wanted == ReplayTracker::apriltag || wanted == ReplayTracker::klt) &&
      !sequence.hasImages()) {
    refuse(sequence, fmt::format("--tracker {} needs images (rgb.txt)",
                                 wanted == ReplayTracker::klt ? "klt" : "apriltag"));
  }
  if (wanted == ReplayTracker::automatic) {
    wanted = sequence.hasImages() ? ReplayTracker::dots : ReplayTracker::tracks;
  }
  if (wanted == ReplayTracker::dots && !canSeeDots) {
    refuse(sequence,
           sequence.hasImages()
               ? "no dots to track: give their start positions as 'dots: [[u, v], ...]' or the "
                 "'target' in sequence.yaml"
               : "--tracker dots needs images (rgb.txt)");
  }
  if (wanted == ReplayTracker::tracks && !sequence.hasTracks()) {
    refuse(sequence, "no tracks.csv and no images: there are no points to observe");
  }
  return wanted;
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
             "the camera's motion is unknown: needs twist.csv, groundtruth.txt or a target of at "
             "least four points in sequence.yaml");
    }
  }
  if (wanted == ReplayMotion::twist && !hasTwist)
    refuse(sequence, "--motion twist needs twist.csv");
  if (wanted == ReplayMotion::groundtruth && !hasPoses) {
    refuse(sequence, "--motion groundtruth needs groundtruth.txt with at least two poses");
  }
  if (wanted == ReplayMotion::target && !hasTarget) {
    refuse(sequence, "--motion target needs a target of at least four points in sequence.yaml");
  }
  return wanted;
}

const char* nameOf(ReplayTracker tracker) {
  switch (tracker) {
    case ReplayTracker::apriltag:
      return "apriltag";
    case ReplayTracker::klt:
      return "klt";
    case ReplayTracker::tracks:
      return "tracks";
    default:
      return "dots";
  }
}

/// Whether points and their ids are known only when they are seen.
bool findsPoints(const Sequence& sequence, ReplayTracker tracker) {
  return tracker == ReplayTracker::klt || (tracker == ReplayTracker::apriltag && !sequence.tags());
}

/// The tags of the target, or all of a family with unknown sizes.
AprilTagTarget tagsOf(const Sequence& sequence, const ReplayOptions& options) {
  if (sequence.tags()) return *sequence.tags();
  AprilTagTarget all{options.tagFamily, {}};
  for (int id = 0; id < aprilTagCount(options.tagFamily); ++id)
    all.tags.push_back({id, {}, Eigen::Isometry3d::Identity()});
  return all;
}

std::unique_ptr<PointTracker> makeTracker(const Sequence& sequence, ReplayTracker tracker,
                                          const ReplayOptions& options) {
  if (tracker == ReplayTracker::tracks) return nullptr;
  if (tracker == ReplayTracker::klt) {
    KltTrackerOptions klt;
    klt.points = options.corners;
    return std::make_unique<KltTracker>(klt);
  }
  if (tracker == ReplayTracker::apriltag) {
    return std::make_unique<AprilTagTracker>(tagsOf(sequence, options));
  }
  if (sequence.dots().empty()) return std::make_unique<DotTracker>(sequence.target());
  std::vector<Eigen::Vector2d> starts;
  for (const PixelPoint& dot : sequence.dots()) starts.emplace_back(dot.u, dot.v);
  return std::make_unique<DotTracker>(starts);
}

/// Every id the tracker may give, ascending; none where it finds its points itself.
std::vector<int> allIds(const Sequence& sequence, ReplayTracker tracker) {
  std::set<int> ids;
  if (findsPoints(sequence, tracker)) return {};
  if (tracker == ReplayTracker::tracks) {
    for (const SequenceFrame& frame : sequence.frames()) {
      for (const PixelPoint& point : frame.tracks) ids.insert(point.id);
    }
  } else if (tracker == ReplayTracker::apriltag) {
    for (int i = 0; i < 4 * static_cast<int>(sequence.tags()->tags.size()); ++i) ids.insert(i);
  } else {
    const std::size_t count =
        sequence.dots().empty() ? sequence.target().points.size() : sequence.dots().size();
    for (std::size_t i = 0; i < count; ++i) ids.insert(static_cast<int>(i));
  }
  return {ids.begin(), ids.end()};
}

/// Unless declared otherwise, the observer takes odometry for exact and the filters have their own
/// default.
OdometryNoise noiseOf(const ReplayOptions& options) {
  if (options.odometryNoise) return *options.odometryNoise;
  return options.depth.estimator == EstimatorKind::nonlinear ? OdometryNoise::none()
                                                             : OdometryNoise();
}

/// Images per second, by the median of their distances [Hz].
double frameRate(const Sequence& sequence) {
  std::vector<double> periods;
  for (std::size_t k = 1; k < sequence.frames().size(); ++k) {
    periods.push_back(sequence.frames()[k].time_s - sequence.frames()[k - 1].time_s);
  }
  if (periods.empty()) return kUsualRate;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return 1 / *middle;
}

EstimatorSetup setupOf(const Sequence& sequence, const ReplayOptions& options) {
  EstimatorSetup setup{options.depth, noiseOf(options), options.odometryScaleSigma,
                       sequence.target()};
  setup.frameRate = frameRate(sequence);
  setup.sigma =
      options.pixelNoise_px.value_or(ReplayOptions::kPixelNoise_px) / sequence.camera().focal_px();
  if (setup.depth.estimator == EstimatorKind::pose) {
    if (const auto why = whyNoTarget(setup.target.points)) {
      refuse(sequence, fmt::format("the estimator 'pose' needs a known target: {}; give "
                                   "'target: {{type: dots, points: [...]}}' in sequence.yaml",
                                   *why));
    }
  }
  return setup;
}

/// Rejected measurements of a corner, less those accepted, before it is given up.
constexpr int kMostRejections = 6;

/// One replay under way.
class Replayer {
 public:
  Replayer(const Sequence& sequence, const ReplayOptions& options)
      : sequence_(sequence),
        camera_(sequence.camera()),
        trackerKind_(chooseTracker(sequence, options.tracker)),
        motionKind_(chooseMotion(sequence, options.motion)),
        ids_(allIds(sequence, trackerKind_)),
        findsPoints_(findsPoints(sequence, trackerKind_)),
        sigma_px_(options.pixelNoise_px),
        prior_{options.depth.initial},
        estimator_(makeEstimator(setupOf(sequence, options),
                                 findsPoints_ ? capacityOf(options) : ids_.size())),
        tracker_(makeTracker(sequence, trackerKind_, options)),
        frameRate_(setupOf(sequence, options)),
        targetPose_(sequence.target(), camera_) {
    if (options.priorSigma_Z) prior_.sigma_chi = *options.priorSigma_Z / (prior_.Z * prior_.Z);
    for (const int id : ids_) estimator_->setPrior(id, prior_);
    const bool measuresItself =
        trackerKind_ == ReplayTracker::klt || trackerKind_ == ReplayTracker::apriltag;
    if (!sigma_px_ && !measuresItself) sigma_px_ = ReplayOptions::kPixelNoise_px;
    if (trackerKind_ == ReplayTracker::apriltag) {
      tags_.emplace(tagsOf(sequence, options), camera_, options.pixelNoise_px);
    }
    log_.timings = {{"image", {}}, {"tracking", {}}, {"estimation", {}}};

    if (motionKind_ == ReplayMotion::twist) rows_ = sequence.odometry();
    if (motionKind_ == ReplayMotion::groundtruth) rows_ = odometryFromPoses(sequence.poses());
    odometry_ = MotionBuffer(std::max(rows_.size(), sequence.frames().size()));
    describe(options);
  }

  RunLog run(const std::function<void(double)>& progress) {
    const std::size_t count = sequence_.frames().size();
    for (std::size_t k = 0; k < count; ++k) {
      log_.frames.push_back(frame(k));
      if (progress) progress(static_cast<double>(k + 1) / static_cast<double>(count));
    }
    log_.frameRate = frameRate_.report();
    if (tags_) log_.tags = tags_->results();
    return std::move(log_);
  }

 private:
  FrameRecord frame(std::size_t k) {
    const SequenceFrame& source = sequence_.frames()[k];
    readOdometry(source.time_s);
    const std::vector<TrackedPoint> points = track(k);
    if (findsPoints_) renewPoints(points);
    Stopwatch watch;
    const std::optional<TargetPose::Result> pose = followTarget(source.time_s, points);
    const Coverage coverage = estimator_->advance(odometry_, source.time_s);
    noteCoverage(source.time_s, coverage);
    const bool isUsed = coverage != Coverage::afterEnd && coverage != Coverage::reversed;
    if (isUsed) correct(points);
    if (trackerKind_ == ReplayTracker::klt) giveUpMovingPoints();
    if (tags_) {
      for (const std::string& event : tags_->compare(points, *estimator_)) {
        log_.events.push_back({source.time_s, event});
      }
    }
    if (const auto news = frameRate_.watch(*estimator_)) {
      log_.events.push_back({source.time_s, *news});
    }

    log_.timings[2].second.push_back(watch.lap());

    FrameRecord record;
    record.time_s = source.time_s;
    for (const int id : ids_) {
      DepthEstimate estimate = estimator_->estimate(id);
      if (estimate.status == DepthStatus::unset) continue;
      if (!isUsed) estimate.status = std::min(estimate.status, DepthStatus::coasting);
      const auto point = std::find_if(points.begin(), points.end(),
                                      [id](const TrackedPoint& p) { return p.id == id; });
      const bool isMeasured = isUsed && point != points.end();
      const Eigen::Vector2d pixel = isMeasured ? Eigen::Vector2d(point->u, point->v)
                                               : camera_.toPixel(estimate.x, estimate.y);
      record.features.push_back(
          {id, pixel.x(), pixel.y(), isMeasured, estimate, trueDepth(source, id, pose)});
    }
    const auto [motion, known] = odometry_.motion(lastTime_s_, source.time_s);
    if (known == Coverage::complete) record.twist = motion.twist();
    lastTime_s_ = source.time_s;
    return record;
  }

  /// The rows that begin before the image, as a robot has them by then; and a later one where the
  /// last of them would not hold that long, since here the next is known.
  void readOdometry(double time_s) {
    const auto isNeeded = [&](const OdometryRow& row) {
      return row.time_s < time_s || odometry_.motion(time_s, time_s).coverage == Coverage::afterEnd;
    };
    for (; rowsRead_ < rows_.size() && isNeeded(rows_[rowsRead_]); ++rowsRead_) {
      odometry_.push(rows_[rowsRead_].time_s, rows_[rowsRead_].twist);
    }
  }

  std::vector<TrackedPoint> track(std::size_t k) {
    const SequenceFrame& source = sequence_.frames()[k];
    if (!tracker_) {
      std::vector<TrackedPoint> points;
      for (const PixelPoint& point : source.tracks)
        points.push_back({point.id, point.u, point.v, 0});
      return points;
    }
    Stopwatch watch;
    const vpImage<unsigned char> image = sequence_.readImage(k);
    log_.timings[0].second.push_back(watch.lap());
    if (k == 0 || k + 1 == sequence_.frames().size()) {
      log_.images.emplace_back(
          k == 0 ? "first" : "last",
          std::vector<unsigned char>(image.bitmap, image.bitmap + image.getSize()));
    }
    watch.lap();
    std::vector<TrackedPoint> points = tracker_->track(
        image, expectedPoints(*estimator_, ids_, odometry_, source.time_s, camera_));
    log_.timings[1].second.push_back(watch.lap());
    return points;
  }

  static std::size_t capacityOf(const ReplayOptions& options) {
    constexpr std::size_t kMostTagCorners = 4 * 64;
    return std::max(kMostTagCorners, static_cast<std::size_t>(options.corners));
  }

  /// Points that the tracker has found or will not give again; ids_ stays ascending.
  void renewPoints(const std::vector<TrackedPoint>& points) {
    for (const int id : tracker_->retired()) {
      estimator_->retire(id);
      const auto place = std::lower_bound(ids_.begin(), ids_.end(), id);
      if (place != ids_.end() && *place == id) ids_.erase(place);
    }
    for (const TrackedPoint& point : points) {
      const auto place = std::lower_bound(ids_.begin(), ids_.end(), point.id);
      if (place != ids_.end() && *place == point.id) continue;
      if (estimator_->setPrior(point.id, prior_)) ids_.insert(place, point.id);
    }
  }

  /// A corner whose measurements go on contradicting the camera's motion moves by itself, or is the
  /// seam of two things at different depths.
  void giveUpMovingPoints() {
    for (const int id : ids_) {
      const bool isRejected = estimator_->estimate(id).status == DepthStatus::rejected;
      int& count = rejections_[id];
      count = isRejected ? count + 1 : std::max(0, count - 1);
      if (count < kMostRejections) continue;
      tracker_->giveUp(id);
      rejections_.erase(id);
    }
  }

  /// With --motion target, the target's pose in this image says how the camera has moved since the
  /// last.
  std::optional<TargetPose::Result> followTarget(double time_s,
                                                 const std::vector<TrackedPoint>& points) {
    if (motionKind_ != ReplayMotion::target) return std::nullopt;
    const std::optional<TargetPose::Result> pose = targetPose_.compute(points);
    if (!pose) return std::nullopt;
    const CameraPose now{time_s, pose->cMo.inverse()};
    if (lastPose_) {
      const double dt = now.time_s - lastPose_->time_s;
      odometry_.push(lastPose_->time_s, Motion::fromPoses(lastPose_->wMc, now.wMc, dt).twist());
      odometry_.holdUntil(now.time_s);
    }
    lastPose_ = now;
    return pose;
  }

  void correct(const std::vector<TrackedPoint>& points) {
    observations_.clear();
    for (const TrackedPoint& point : points) {
      const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
      const double sigma_px = sigma_px_.value_or(point.sigma_px);
      observations_.push_back({point.id, {s.x(), s.y(), sigma_px / camera_.focal_px()}});
    }
    estimator_->correct(observations_);
  }

  double trueDepth(const SequenceFrame& source, int id,
                   const std::optional<TargetPose::Result>& pose) const {
    for (const TrueDepth& truth : source.truth) {
      if (truth.id == id) return truth.Z;
    }
    if (tags_ && source.truth.empty()) return tags_->depthByPose(id);
    if (!pose || id < 0 || static_cast<std::size_t>(id) >= sequence_.target().points.size()) {
      return kUnknown;
    }
    return (pose->cMo * sequence_.target().points[static_cast<std::size_t>(id)]).z();
  }

  void noteCoverage(double time_s, Coverage coverage) {
    if (coverage == coverage_) return;
    coverage_ = coverage;
    log_.events.push_back({time_s, coverage == Coverage::complete
                                       ? std::string("odometry covers the images again")
                                       : fmt::format("odometry: {}", toString(coverage))});
  }

  void describe(const ReplayOptions& options) {
    log_.command = "replay";
    log_.name = sequence_.name();
    log_.camera = camera_;
    nlohmann::ordered_json configuration{
        {"tracker", nameOf(trackerKind_)},
        {"motion", motionKind_ == ReplayMotion::twist         ? "twist"
                   : motionKind_ == ReplayMotion::groundtruth ? "groundtruth"
                                                              : "target"},
        {"estimator", toString(options.depth.estimator)},
        {"prior_Z", options.depth.initial},
        {"prior_sigma_Z", nullptr},
        {"pixel_noise", nullptr},
        {"odometry_noise", nullptr},
        {"odometry_scale_sigma", options.odometryScaleSigma},
        {"Z_min", options.depth.Z_min},
        {"Z_max", options.depth.Z_max}};
    if (sigma_px_) configuration["pixel_noise"] = *sigma_px_;
    if (options.priorSigma_Z) configuration["prior_sigma_Z"] = *options.priorSigma_Z;
    if (const auto& noise = options.odometryNoise) {
      configuration["odometry_noise"] = {noise->sigma_v, noise->sigma_w};
    }
    log_.configuration = configuration.dump();
  }

  const Sequence& sequence_;
  PinholeCamera camera_;
  ReplayTracker trackerKind_;
  ReplayMotion motionKind_;
  std::vector<int> ids_;            // ascending
  bool findsPoints_;                // ids_ come and go
  std::optional<double> sigma_px_;  // none: the tracker's own
  DepthPrior prior_;
  std::map<int, int> rejections_;  // by id, less the measurements accepted
  std::unique_ptr<PointSetEstimator> estimator_;
  std::unique_ptr<PointTracker> tracker_;  // none: tracks.csv
  std::optional<TagSizeMonitor> tags_;
  FrameRateMonitor frameRate_;
  TargetPose targetPose_;
  std::optional<CameraPose> lastPose_;
  std::vector<OdometryRow> rows_;  // of the sequence; none when the target tells the motion
  std::size_t rowsRead_ = 0;
  MotionBuffer odometry_;
  std::vector<PointObservation> observations_;
  Coverage coverage_ = Coverage::complete;
  double lastTime_s_ = kUnknown;
  RunLog log_;
};

}  // namespace

ReplayOptions ReplayOptions::of(const Sequence& sequence) {
  const ReplayHints& hints = sequence.replayHints();
  ReplayOptions options;
  if (hints.estimator) {
    options.depth.estimator = availableEstimator(
        *hints.estimator, {sequence.folder() + "/sequence.yaml", 0, "replay.estimator"});
  }
  options.depth.initial = hints.prior.value_or(options.depth.initial);
  options.pixelNoise_px = hints.pixel_noise;
  if (const auto& noise = hints.odometry_noise) {
    options.odometryNoise =
        noise->isZero() ? OdometryNoise::none()
                        : OdometryNoise::white((*noise)[0], (*noise)[1], hints.odometry_mode);
  }
  options.odometryScaleSigma = hints.odometry_scale_sigma.value_or(options.odometryScaleSigma);
  options.depth.Z_min = hints.Z_min.value_or(options.depth.Z_min);
  options.depth.Z_max = hints.Z_max.value_or(options.depth.Z_max);
  options.depth.gains.settling = hints.settling.value_or(options.depth.gains.settling);
  options.depth.gains.W_min = hints.W_min.value_or(options.depth.gains.W_min);
  options.depth.gains.k = hints.k;
  options.depth.gains.k_3 = hints.k_3;
  return options;
}

RunLog replay(const Sequence& sequence, const ReplayOptions& options,
              const std::function<void(double)>& progress) {
  return Replayer(sequence, options).run(progress);
}

}  // namespace depthservo
