#include "observation/ImageObserver.h"

#include <fmt/format.h>

#include <algorithm>

#include "observation/Stopwatch.h"
#include "observation/expectedPoints.h"
#include "observation/featureRecord.h"

namespace depthservo {
namespace {

/// A point is given up after four rejections in a row; or, since the filters start a young point
/// anew after two, after a dozen images of which every other one is rejected.
constexpr int kRejection = 2, kMostRejections = 8;

}  // namespace

ImageObserver::ImageObserver(Parts parts)
    : parts_(std::move(parts)),
      estimator_(makeEstimator(parts_.estimator,
                               parts_.capacity > 0 ? parts_.capacity : parts_.ids.size())),
      frameRate_(parts_.estimator),
      odometry_(parts_.odometryCapacity) {
  if (parts_.followed) {
    targetPose_.emplace(*parts_.followed, parts_.camera);
  } else if (parts_.capacity == 0 && parts_.estimator.depth.estimator != EstimatorKind::pose) {
    diagnosis_.emplace(parts_.ids.size(), parts_.declaredNoise,
                       parts_.pixelNoise_px / parts_.camera.focal_px(), parts_.prior,
                       parts_.estimator.depth.range(), jointStatesOf(*estimator_));
  }
  if (parts_.tags) tags_.emplace(*parts_.tags, parts_.camera);
  for (const int id : parts_.ids) estimator_->setPrior(id, parts_.prior);
}

bool ImageObserver::isCovered(double time_s) {
  readOdometry(time_s);
  return odometry_.motion(time_s, time_s).coverage == Coverage::complete;
}

FrameRecord ImageObserver::observe(const Input& input) {
  readOdometry(input.time_s);
  Stopwatch watch;
  const std::vector<TrackedPoint> points = track(input);
  trackingTimes_.push_back(watch.lap());
  if (parts_.capacity > 0) renewPoints(points);
  const std::optional<TargetPose::Result> pose = followTarget(input.time_s, points);
  const Coverage coverage = estimator_->advance(odometry_, input.time_s);
  noteCoverage(input.time_s, coverage);
  const bool isUsed =
      input.isMotionKnown && coverage != Coverage::afterEnd && coverage != Coverage::reversed;
  if (isUsed) correct(input.time_s, points);
  if (parts_.capacity > 0) giveUpMovingPoints();
  if (tags_) {
    for (std::string& event : tags_->compare(points, *estimator_)) {
      events_.push_back({input.time_s, std::move(event)});
    }
  }
  estimationTimes_.push_back(watch.lap());
  if (const auto news = frameRate_.watch(*estimator_)) {
    events_.push_back({input.time_s, *news});
  }

  FrameRecord record;
  record.time_s = input.time_s;
  const std::vector<TrackedPoint> nothing;
  for (const int id : parts_.ids) {
    DepthEstimate estimate = estimator_->estimate(id);
    if (estimate.status == DepthStatus::unset) continue;
    if (diagnosis_) estimate = diagnosis_->honest(estimate);
    if (!isUsed && estimate.status != DepthStatus::lost) estimate.status = DepthStatus::coasting;
    FeatureRecord feature = featureRecord(id, estimate, isUsed ? points : nothing, parts_.camera,
                                          diagnosis_ ? &*diagnosis_ : nullptr);
    feature.Z_true = trueDepth(input, feature, pose);
    record.features.push_back(feature);
  }
  const auto [motion, known] = odometry_.motion(lastTime_s_, input.time_s);
  if (known == Coverage::complete) record.twist = motion.twist();
  lastTime_s_ = input.time_s;
  return record;
}

/// The rows that begin before the image, as a robot has them by then; and a later one where the
/// last of them would not hold that long and the next is known.
void ImageObserver::readOdometry(double time_s) {
  const auto isNeeded = [&](const OdometryRow& row) {
    return row.time_s < time_s || odometry_.motion(time_s, time_s).coverage == Coverage::afterEnd;
  };
  for (; !waiting_.empty() && isNeeded(waiting_.front()); waiting_.pop_front()) {
    addOdometry(waiting_.front());
  }
}

void ImageObserver::addOdometry(const OdometryRow& row) {
  odometry_.push(row.time_s, row.twist);
  used_.push_back(row);
}

/// Points with the noise that the estimator is told.
std::vector<TrackedPoint> ImageObserver::track(const Input& input) {
  std::vector<TrackedPoint> points;
  if (parts_.tracker) {
    points = parts_.tracker->track(*input.image, expectedPoints(*estimator_, parts_.ids, odometry_,
                                                                input.time_s, parts_.camera));
  } else {
    for (const PixelPoint& point : *input.tracks) points.push_back({point.id, point.u, point.v});
  }
  if (!parts_.takesTrackersNoise) {
    for (TrackedPoint& point : points) point.sigma_px = parts_.pixelNoise_px;
  }
  return points;
}

/// The target's pose in this image says how the camera has moved since the last.
std::optional<TargetPose::Result> ImageObserver::followTarget(
    double time_s, const std::vector<TrackedPoint>& points) {
  if (!targetPose_) return std::nullopt;
  const std::optional<TargetPose::Result> pose = targetPose_->compute(points);
  if (!pose) return std::nullopt;
  const CameraPose now{time_s, pose->cMo.inverse()};
  if (lastPose_) {
    const double dt = now.time_s - lastPose_->time_s;
    addOdometry({lastPose_->time_s, Motion::fromPoses(lastPose_->wMc, now.wMc, dt).twist()});
    odometry_.holdUntil(now.time_s);
  }
  lastPose_ = now;
  return pose;
}

void ImageObserver::correct(double time_s, const std::vector<TrackedPoint>& points) {
  observations_.clear();
  for (const TrackedPoint& point : points) {
    const Eigen::Vector2d s = parts_.camera.normalise(point.u, point.v);
    const double sigma = point.sigma_px / parts_.camera.focal_px(s.x(), s.y());
    observations_.push_back({point.id, {s.x(), s.y(), sigma}});
  }
  estimator_->correct(observations_);
  if (!diagnosis_) return;
  if (const auto news = diagnosis_->see(time_s, odometry_, observations_)) {
    events_.push_back({time_s, *news});
  }
}

void ImageObserver::finish(RunLog& log) {
  log.odometry = std::move(used_);
  if (diagnosis_) log.diagnosis = diagnosis_->result();
  log.joint = jointStatesOf(*estimator_);
  log.frameRate = frameRate_.report();
  if (tags_) log.tags = tags_->results();
  log.timings.emplace_back("tracking", std::move(trackingTimes_));
  log.timings.emplace_back("estimation", std::move(estimationTimes_));
}

double ImageObserver::trueDepth(const Input& input, const FeatureRecord& feature,
                                const std::optional<TargetPose::Result>& pose) const {
  if (input.truth) {
    for (const TrueDepth& truth : *input.truth) {
      if (truth.id == feature.id) return truth.Z;
    }
  }
  if (input.depth && feature.measured) {
    if (const auto Z = input.depth->at(feature.u, feature.v)) return *Z;
  }
  const bool hasTruth = input.depth || (input.truth && !input.truth->empty());
  if (tags_ && !hasTruth) return tags_->depthByPose(feature.id);
  if (!pose || feature.id < 0) return kUnknown;
  const auto index = static_cast<std::size_t>(feature.id);
  return index < parts_.followed->points.size() ? (pose->cMo * parts_.followed->points[index]).z()
                                                : kUnknown;
}

/// Points that the tracker has found, or will not give again; ids stay ascending.
void ImageObserver::renewPoints(const std::vector<TrackedPoint>& points) {
  std::vector<int>& ids = parts_.ids;
  for (const int id : parts_.tracker->retired()) {
    estimator_->retire(id);
    const auto place = std::lower_bound(ids.begin(), ids.end(), id);
    if (place != ids.end() && *place == id) ids.erase(place);
  }
  for (const TrackedPoint& point : points) {
    const auto place = std::lower_bound(ids.begin(), ids.end(), point.id);
    if (place != ids.end() && *place == point.id) continue;
    if (estimator_->setPrior(point.id, parts_.prior)) ids.insert(place, point.id);
  }
}

/// A point whose measurements go on contradicting the camera's motion moves by itself, or is the
/// seam of two things at different depths.
void ImageObserver::giveUpMovingPoints() {
  for (const int id : parts_.ids) {
    const bool isRejected = estimator_->estimate(id).status == DepthStatus::rejected;
    int& count = rejections_[id];
    count = isRejected ? count + kRejection : std::max(0, count - 1);
    if (count < kMostRejections) continue;
    parts_.tracker->giveUp(id);
    rejections_.erase(id);
  }
}

void ImageObserver::noteCoverage(double time_s, Coverage coverage) {
  if (coverage == coverage_) return;
  coverage_ = coverage;
  events_.push_back({time_s, coverage == Coverage::complete
                                 ? std::string("odometry covers the images again")
                                 : fmt::format("odometry: {}", toString(coverage))});
}

}  // namespace depthservo
