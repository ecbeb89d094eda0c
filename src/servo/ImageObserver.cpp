#include "servo/ImageObserver.h"

#include <fmt/format.h>

#include <algorithm>

#include "servo/expectedPoints.h"

namespace depthservo {

ImageObserver::ImageObserver(Parts parts)
    : parts_(std::move(parts)),
      estimator_(makeEstimator(parts_.estimator, parts_.ids.size())),
      frameRate_(parts_.estimator),
      odometry_(parts_.odometryCapacity) {
  if (parts_.followed) {
    targetPose_.emplace(*parts_.followed, parts_.camera);
  } else if (parts_.estimator.depth.estimator != EstimatorKind::pose) {
    diagnosis_.emplace(parts_.ids.size(), parts_.declaredNoise,
                       parts_.pixelNoise_px / parts_.camera.focal_px(), parts_.prior,
                       parts_.estimator.depth.range());
  }
  for (const int id : parts_.ids) estimator_->setPrior(id, parts_.prior);
}

bool ImageObserver::isCovered(double time_s) {
  readOdometry(time_s);
  return odometry_.motion(time_s, time_s).coverage == Coverage::complete;
}

FrameRecord ImageObserver::observe(const Input& input) {
  readOdometry(input.time_s);
  const std::vector<TrackedPoint> points = track(input);
  const std::optional<TargetPose::Result> pose = followTarget(input.time_s, points);
  const Coverage coverage = estimator_->advance(odometry_, input.time_s);
  noteCoverage(input.time_s, coverage);
  const bool isUsed =
      input.isMotionKnown && coverage != Coverage::afterEnd && coverage != Coverage::reversed;
  if (isUsed) correct(input.time_s, points);
  if (const auto news = frameRate_.watch(*estimator_)) {
    events_.push_back({input.time_s, *news});
  }

  FrameRecord record;
  record.time_s = input.time_s;
  for (const int id : parts_.ids) {
    DepthEstimate estimate = estimator_->estimate(id);
    if (estimate.status == DepthStatus::unset) continue;
    if (diagnosis_) estimate = diagnosis_->honest(estimate);
    if (!isUsed && estimate.status != DepthStatus::lost) estimate.status = DepthStatus::coasting;
    const auto point = std::find_if(points.begin(), points.end(),
                                    [id](const TrackedPoint& p) { return p.id == id; });
    const bool isMeasured = isUsed && point != points.end();
    const Eigen::Vector2d pixel = isMeasured ? Eigen::Vector2d(point->u, point->v)
                                             : parts_.camera.toPixel(estimate.x, estimate.y);
    FeatureRecord feature{id, pixel.x(), pixel.y(), isMeasured, estimate};
    feature.Z_true = trueDepth(input, feature, pose);
    if (diagnosis_) feature.frames_to_5pct = diagnosis_->framesTo5Percent(estimate);
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

std::vector<TrackedPoint> ImageObserver::track(const Input& input) {
  if (parts_.tracker) {
    return parts_.tracker->track(*input.image, expectedPoints(*estimator_, parts_.ids, odometry_,
                                                              input.time_s, parts_.camera));
  }
  std::vector<TrackedPoint> points;
  for (const PixelPoint& point : *input.tracks) points.push_back({point.id, point.u, point.v, 0});
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
    const double sigma = parts_.pixelNoise_px / parts_.camera.focal_px(s.x(), s.y());
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
  if (!pose || feature.id < 0) return kUnknown;
  const auto index = static_cast<std::size_t>(feature.id);
  return index < parts_.followed->points.size() ? (pose->cMo * parts_.followed->points[index]).z()
                                                : kUnknown;
}

void ImageObserver::noteCoverage(double time_s, Coverage coverage) {
  if (coverage == coverage_) return;
  coverage_ = coverage;
  events_.push_back({time_s, coverage == Coverage::complete
                                 ? std::string("odometry covers the images again")
                                 : fmt::format("odometry: {}", toString(coverage))});
}

}  // namespace depthservo
