#include "depthservo/observation/Observer.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "depthservo/depth/NoiseLearner.h"
#include "depthservo/tracking/TargetPose.h"
#include "observation/FrameRateMonitor.h"
#include "observation/ObserverSetup.h"
#include "observation/SelfDiagnosis.h"
#include "observation/Stopwatch.h"
#include "observation/TagSizeMonitor.h"
#include "observation/expectedPoints.h"
#include "observation/featureRecord.h"

namespace depthservo {
namespace {

/// A point is given up after four rejections in a row; or, since the filters start a young point
/// anew after two, after a dozen images of which every other one is rejected.
constexpr int kRejection = 2, kMostRejections = 8;

/// Of points that a tracker finds, so many are judged by the diagnosis.
constexpr std::size_t kMostJudged = 64;

/// How near, as a share of it, a depth at the end of the range is.
constexpr double kAtEnd = 1e-9;

/// Sigma of a depth that is told [m]: as good as exact.
constexpr double kToldSigma_Z = 1e-6;

}  // namespace

struct Observer::Parts {
  explicit Parts(ObserverSetup s)
      : setup(std::move(s)),
        estimator(makeEstimator(setup.estimator,
                                setup.findsPoints() ? setup.capacity : setup.ids.size())),
        frameRate(setup.estimator),
        odometry(setup.odometryRows, setup.rowPeriod_s) {
    odometry.setMeaning(setup.rows);
    if (setup.followed) {
      targetPose.emplace(*setup.followed, setup.camera);
    } else if (setup.estimator.depth.estimator != EstimatorKind::pose) {
      diagnosis.emplace(setup.findsPoints() ? kMostJudged : setup.ids.size(), setup.declaredNoise,
                        setup.pixelNoise_px / setup.camera.focal_px(), setup.prior,
                        setup.estimator.depth.range(), jointStatesOf(*estimator),
                        sharedErrorsOf(setup.estimator));
    }
    if (setup.learnsNoise) {
      learner.emplace(std::max(setup.capacity, setup.ids.size()), *sharedErrorsOf(setup.estimator),
                      setup.pixelNoise_px);
    }
    if (setup.tags) tags.emplace(*setup.tags, setup.camera);
    for (const int id : setup.ids) estimator->setPrior(id, setup.prior);
    observations.reserve(std::max(setup.capacity, setup.ids.size()));
  }

  void note(double time_s, std::string what) { events.push_back({time_s, std::move(what)}); }

  void track(const Exposure& exposure);
  std::optional<TargetPose::Result> followTarget(double time_s,
                                                 const std::vector<TrackedPoint>& points);
  void renewPoints(const std::vector<TrackedPoint>& points);
  void observe(const std::vector<TrackedPoint>& points);
  void correct(const Exposure& exposure);
  void learnNoise(const Motion& motion);
  void giveUpMovingPoints();
  void update(double time_s, const std::vector<TrackedPoint>& points);
  void noteCoverage(double time_s, Coverage coverage);
  FeatureRecord record(int id, DepthEstimate estimate, const Exposure& exposure,
                       const std::vector<TrackedPoint>& points) const;
  void setTruth(FeatureRecord& feature, const Exposure& exposure) const;
  void noteHidden(double time_s, const FeatureRecord& feature);
  bool isHeld(const DepthEstimate& estimate) const {
    const DepthRange& range = estimator->range();
    return estimate.Z() >= range.Z_max * (1 - kAtEnd) || estimate.Z() <= range.Z_min * (1 + kAtEnd);
  }
  void judgeRange(RunLog& log) const;
  void judgePoses(RunLog& log) const;
  void name(RunDiagnosis& result, ConsistencyMonitor::Cause cause, double size,
            const std::string& explanation) const;

  ObserverSetup setup;
  std::unique_ptr<PointSetEstimator> estimator;
  FrameRateMonitor frameRate;
  std::optional<SelfDiagnosis> diagnosis;  // none where images would be judged by themselves, nor
                                           // of a known target, which may move
  std::optional<TagSizeMonitor> tags;
  std::optional<NoiseLearner> learner;
  std::map<int, int> rejections;  // by id, weighted, less those accepted
  std::map<int, bool> wasMeasured;
  LastLaps trackingTimes, estimationTimes;  // by image [s]
  std::optional<TargetPose> targetPose;
  std::optional<TargetPose::Result> pose;  // of the followed target in this image
  std::optional<CameraPose> lastPose;
  MotionBuffer odometry;
  std::vector<OdometryRow> rowsByTarget;
  std::vector<TrackedPoint> tracked;  // in this image
  std::vector<PointObservation> observations;
  Coverage coverage = Coverage::complete;
  bool isTruthOfMotion = false;
  bool isRecorded = true;  // what nobody asks for who wants the outcome alone
  double lastTime_s = kUnknown;
  std::vector<Event> events;
};

Observer::Observer(const ObservedSource& source, const ObservationOptions& options)
    : parts_(std::make_unique<Parts>(ObserverSetup::of(source, options))) {}

Observer::~Observer() = default;

void Observer::omitDiagnosis() {
  parts_->diagnosis.reset();
  parts_->isRecorded = false;
}
MotionBuffer& Observer::odometry() { return parts_->odometry; }
const PointSetEstimator& Observer::estimator() const { return *parts_->estimator; }
const std::vector<PointObservation>& Observer::measured() const { return parts_->observations; }
const std::vector<int>& Observer::ids() const { return parts_->setup.ids; }
std::vector<Event> Observer::takeEvents() { return std::exchange(parts_->events, {}); }

FrameRecord Observer::observe(const Exposure& exposure, FrameRecord spare) {
  Parts& p = *parts_;
  const double time_s = exposure.time_s;
  Stopwatch stopwatch;
  std::vector<TrackedPoint>& points = p.tracked;
  p.track(exposure);
  if (p.isRecorded) p.trackingTimes.add(stopwatch.lap());
  if (p.setup.findsPoints()) p.renewPoints(points);
  p.pose = p.followTarget(time_s, points);
  if (p.pose && !exposure.depth && exposure.truth.empty()) p.isTruthOfMotion = true;
  const Coverage coverage = p.estimator->advance(p.odometry, time_s);
  p.noteCoverage(time_s, coverage);
  const bool isUsed =
      exposure.isMotionKnown && coverage != Coverage::afterEnd && coverage != Coverage::reversed;
  if (!isUsed) points.clear();
  p.observe(points);
  if (isUsed) p.correct(exposure);
  MotionBuffer::Interval since;
  if (p.isRecorded || p.learner) since = p.odometry.motion(p.lastTime_s, time_s);
  if (isUsed && p.learner) p.learnNoise(since.motion);
  if (p.setup.findsPoints()) p.giveUpMovingPoints();
  if (p.isRecorded) p.estimationTimes.add(stopwatch.lap());
  if (isUsed) p.update(time_s, points);

  FrameRecord frame;
  frame.features = std::move(spare.features);
  frame.features.clear();
  frame.time_s = time_s;
  frame.features.reserve(p.setup.ids.size());
  for (const int id : p.setup.ids) {
    DepthEstimate estimate = p.estimator->estimate(id);
    if (estimate.status == DepthStatus::unset) continue;
    if (!isUsed && estimate.status != DepthStatus::lost) estimate.status = DepthStatus::coasting;
    frame.features.push_back(p.record(id, estimate, exposure, points));
    p.noteHidden(time_s, frame.features.back());
  }
  if (p.isRecorded && since.coverage == Coverage::complete) frame.twist = since.motion.twist();
  p.lastTime_s = time_s;
  return frame;
}

/// Points with the noise that the estimator is told.
void Observer::Parts::track(const Exposure& exposure) {
  tracked = exposure.points;
  if (setup.tracker) {
    tracked = setup.tracker->track(exposure.image, expectedPoints(*estimator, setup.ids, odometry,
                                                                  exposure.time_s, setup.camera));
    if (std::string news = setup.tracker->news(); !news.empty()) {
      note(exposure.time_s, std::move(news));
    }
  }
  if (!setup.takesTrackersNoise) {
    for (TrackedPoint& point : tracked) point.sigma_px = setup.pixelNoise_px;
  }
}

/// The target's pose in this image says how the camera has moved since the last.
std::optional<TargetPose::Result> Observer::Parts::followTarget(
    double time_s, const std::vector<TrackedPoint>& points) {
  if (!targetPose) return std::nullopt;
  const std::optional<TargetPose::Result> found = targetPose->compute(points);
  if (!found) return std::nullopt;
  const CameraPose now{time_s, found->cMo.inverse()};
  if (lastPose) {
    const double dt = now.time_s - lastPose->time_s;
    const OdometryRow row{lastPose->time_s, Motion::fromPoses(lastPose->wMc, now.wMc, dt).twist()};
    if (!odometry.push(row.time_s, row.twist)) odometry.pushUnknown(row.time_s);
    rowsByTarget.push_back(row);
    odometry.holdUntil(now.time_s);
  }
  lastPose = now;
  return found;
}

/// In normalised coordinates.
void Observer::Parts::observe(const std::vector<TrackedPoint>& points) {
  observations.clear();
  const double factor = learner && !setup.isPixelNoiseGiven ? learner->pixelFactor() : 1;
  for (const TrackedPoint& point : points) {
    const Eigen::Vector2d s = setup.camera.normalise(point.u, point.v);
    const double sigma = factor * point.sigma_px / setup.camera.focal_px(s.x(), s.y());
    observations.push_back({point.id, {s.x(), s.y(), sigma}});
  }
}

void Observer::Parts::correct(const Exposure& exposure) {
  estimator->correct(observations);
  if (setup.estimator.depth.estimator != EstimatorKind::trueDepth) return;
  for (const TruePoint& point : exposure.truth) {
    const DepthPrior told{point.Z, kToldSigma_Z / (point.Z * point.Z)};
    if (told.isUsable()) estimator->correctDepth(point.id, told);
  }
}

/// What this image tells of the noise, for the next one.
void Observer::Parts::learnNoise(const Motion& motion) {
  learner->observe(motion, observations, *estimator);
  estimator->setNoise(learner->noise());
}

/// What the monitors have to say of this image.
void Observer::Parts::update(double time_s, const std::vector<TrackedPoint>& points) {
  if (diagnosis) {
    if (const auto news = diagnosis->update(time_s, odometry, observations)) note(time_s, *news);
  }
  if (tags) {
    for (std::string& news : tags->compare(points, *estimator)) note(time_s, std::move(news));
  }
  if (const auto news = frameRate.update(*estimator)) note(time_s, *news);
}

/// A point where it was found or, when it was not, where it is believed to be.
FeatureRecord Observer::Parts::record(int id, DepthEstimate estimate, const Exposure& exposure,
                                      const std::vector<TrackedPoint>& points) const {
  if (diagnosis) estimate = diagnosis->honest(id, estimate);
  // At the end of the range nothing is known but that the depth is beyond.
  if (isHeld(estimate)) estimate.sigma_chi = std::max(estimate.sigma_chi, estimate.chi);
  FeatureRecord feature =
      featureRecord(id, estimate, points, setup.camera, diagnosis ? &*diagnosis : nullptr);
  setTruth(feature, exposure);
  return feature;
}

void Observer::Parts::setTruth(FeatureRecord& feature, const Exposure& exposure) const {
  for (const TruePoint& truth : exposure.truth) {
    if (setup.findsPoints()) break;  // its ids are those of no one else's points
    if (truth.id != feature.id) continue;
    feature.Z_true = truth.Z;
    feature.u_true = truth.u;
    feature.v_true = truth.v;
    return;
  }
  if (exposure.depth && feature.measured) {
    if (const auto Z = exposure.depth->at(feature.u, feature.v)) {
      feature.Z_true = *Z;
      return;
    }
  }
  const bool hasTruth = exposure.depth || !exposure.truth.empty();
  if (tags && !hasTruth) {
    feature.Z_true = tags->depthByPose(feature.id);
  } else if (pose && !hasTruth && feature.id >= 0) {
    const auto index = static_cast<std::size_t>(feature.id);
    const auto& target = setup.followed->points;
    if (index < target.size()) feature.Z_true = (pose->cMo * target[index]).z();
  }
}

/// Of the points of a target; those that a tracker chooses come and go.
void Observer::Parts::noteHidden(double time_s, const FeatureRecord& feature) {
  if (setup.findsPoints()) return;
  const auto [was, isNew] = wasMeasured.try_emplace(feature.id, feature.measured);
  if (isNew || was->second == feature.measured) return;
  was->second = feature.measured;
  note(time_s,
       fmt::format("{} {} {}", setup.noun, feature.id, feature.measured ? "seen again" : "hidden"));
}

/// Points that the tracker has found, or will not give again; ids stay ascending.
void Observer::Parts::renewPoints(const std::vector<TrackedPoint>& points) {
  std::vector<int>& ids = setup.ids;
  for (const int id : setup.tracker->retired()) {
    estimator->retire(id);
    if (diagnosis) diagnosis->retire(id);
    rejections.erase(id);
    const auto place = std::lower_bound(ids.begin(), ids.end(), id);
    if (place != ids.end() && *place == id) ids.erase(place);
  }
  for (const TrackedPoint& point : points) {
    const auto place = std::lower_bound(ids.begin(), ids.end(), point.id);
    if (place != ids.end() && *place == point.id) continue;
    if (estimator->setPrior(point.id, setup.prior)) ids.insert(place, point.id);
  }
}

/// A point whose measurements go on contradicting the camera's motion moves by itself, or is the
/// seam of two things at different depths.
void Observer::Parts::giveUpMovingPoints() {
  for (const int id : setup.ids) {
    const bool isRejected = estimator->estimate(id).status == DepthStatus::rejected;
    int& count = rejections[id];
    count = isRejected ? count + kRejection : std::max(0, count - 1);
    if (count < kMostRejections) continue;
    setup.tracker->giveUp(id);
    rejections.erase(id);
  }
}

void Observer::Parts::noteCoverage(double time_s, Coverage now) {
  if (now == coverage) return;
  coverage = now;
  if (now == Coverage::complete) return note(time_s, "odometry covers the images again");
  const double since_s = odometry.unknownSince(lastTime_s, time_s);
  const std::string since =
      std::isnan(since_s) ? "" : fmt::format("; the motion is not known since {:.3f} s", since_s);
  note(time_s, fmt::format("odometry: {}{}", toString(now), since));
}

/// Depths that stand at the end of the range are a sign of another unit. A target that moves, or
/// noise, is then only what else would explain images of a depth beyond.
void Observer::Parts::judgeRange(RunLog& log) const {
  using Cause = ConsistencyMonitor::Cause;
  if (!log.diagnosis || setup.ids.empty()) return;
  const Cause cause = log.diagnosis->latest.cause;
  const bool isBetterKnown = cause != Cause::movingTarget && cause != Cause::noise;
  if (log.diagnosis->isFault() && isBetterKnown) return;
  const auto held =
      static_cast<std::size_t>(std::count_if(setup.ids.begin(), setup.ids.end(), [&](int id) {
        const DepthEstimate estimate = estimator->estimate(id);
        return estimate.status != DepthStatus::unset && estimate.status != DepthStatus::lost &&
               isHeld(estimate);
      }));
  if (2 * held <= setup.ids.size()) return;
  const DepthRange& range = estimator->range();
  const std::string explanation = fmt::format(
      "{} of {} depths are held at the end of the range {:g} to {:g} m: the true ones are beyond; "
      "is "
      "the twist in m/s, is the range right?",
      held, setup.ids.size(), range.Z_min, range.Z_max);
  name(*log.diagnosis, Cause::unit, 0, explanation);
}

/// Poses that err clearly more than the profile allows. Where they err anew in each image nothing
/// else that was found with the profile counts; what lasts may have other causes.
void Observer::Parts::judgePoses(RunLog& log) const {
  if (!log.diagnosis || !log.noise) return;
  const ErrorProfile& allowed = *setup.estimator.errors;
  bool exceeds = false, isAnew = false;
  const auto judge = [&](const NoiseLevel& learnt, double sigma) {
    constexpr double kClearly = 1.5;  // levels are learnt to 15 %
    if (learnt.sigma() <= kClearly * sigma) return learnt.sigma();
    exceeds = true;
    isAnew = isAnew || learnt.white > learnt.lasting.sigma;
    return learnt.sigma();
  };
  const double position_m = judge(log.noise->position_m, allowed.position_m);
  const double angle_rad = judge(log.noise->angle_rad, allowed.angle_rad);
  if (!exceeds || (log.diagnosis->isFault() && !isAnew)) return;
  const std::string explanation = fmt::format(
      "The profile allows {:.2g} mm and {:.2g} mrad, learnt were {:.2g} mm and {:.2g} mrad; sigma "
      "reckons with that, and depths are as vague as the poses are",
      1e3 * allowed.position_m, 1e3 * allowed.angle_rad, 1e3 * position_m, 1e3 * angle_rad);
  name(*log.diagnosis, ConsistencyMonitor::Cause::poseNoise, position_m, explanation);
}

/// A cause that is found at the end.
void Observer::Parts::name(RunDiagnosis& result, ConsistencyMonitor::Cause cause, double size,
                           const std::string& explanation) const {
  result.latest.cause = cause;
  result.latest.size = size;
  result.latest.rival = ConsistencyMonitor::Cause::none;
  result.first_s = lastTime_s;
  result.explanation = explanation;
}

void Observer::finish(RunLog& log) {
  Parts& p = *parts_;
  if (p.targetPose) log.odometry = std::move(p.rowsByTarget);
  if (p.diagnosis) log.diagnosis = p.diagnosis->result();
  if (p.learner && p.learner->isLearnt()) log.noise = p.learner->noise();
  p.judgeRange(log);
  p.judgePoses(log);
  log.rows = p.setup.rows;
  log.profile = p.setup.profile;
  const EstimatorKind kind = p.setup.estimator.depth.estimator;
  const bool takesErrors = kind == EstimatorKind::filter || kind == EstimatorKind::joint;
  if (takesErrors) log.errors = p.setup.estimator.errors;
  log.joint = jointStatesOf(*p.estimator);
  log.frameRate = p.frameRate.report();
  if (p.tags) log.tags = p.tags->results();
  log.isDepthObserved = kind != EstimatorKind::constant;
  log.isTruthOfMotion = p.isTruthOfMotion;
  log.timings.emplace_back("tracking", p.trackingTimes.take());
  log.timings.emplace_back("estimation", p.estimationTimes.take());
}

}  // namespace depthservo
