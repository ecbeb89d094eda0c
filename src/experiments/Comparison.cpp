#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "depthservo/experiments/Compare.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "experiments/Measured.h"
#include "motion/median.h"
#include "observation/ObserverSetup.h"
#include "observation/errorsOf.h"
#include "observation/estimatorWords.h"

namespace depthservo {
namespace {

constexpr double kClose = 0.05;          // relative error of a depth that counts as good
constexpr std::size_t kMostColumns = 6;  // times that are shown unless the user names some
constexpr int kTimedPasses = 3;          // the fastest counts
constexpr double kSameInstant_s = 1e-6;
constexpr std::size_t kMostJoint = 16;  // points of the joint limit: it costs their number cubed

/// How points do in one image: all of them, and those that have been known for a second.
class FrameStatistics {
 public:
  void add(double value, bool isOld) {
    if (!std::isfinite(value)) return;
    squares_ += value * value;
    ++count_;
    if (isOld) old_.push_back(std::abs(value));
  }
  double rms() const {
    return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : kUnknown;
  }
  double median() { return old_.empty() ? kUnknown : detail::medianOf(old_); }
  /// Share of the old ones that are close.
  double closeShare() const {
    if (old_.empty()) return kUnknown;
    const auto close =
        std::count_if(old_.begin(), old_.end(), [](double value) { return value < kClose; });
    return static_cast<double>(close) / static_cast<double>(old_.size());
  }

 private:
  double squares_ = 0;
  std::size_t count_ = 0;
  std::vector<double> old_;
};

/// Frames from each point's first known error until the error stays small; greatest of the points.
double framesTo5pct(const Measured& measured, const PointTable& errors) {
  struct Story {
    std::optional<std::size_t> first;
    std::size_t last = 0, good = 0;
  };
  std::vector<Story> stories(measured.ids.size());
  for (std::size_t k = 0; k < errors.size(); ++k) {
    for (std::size_t j = 0; j < errors[k].size(); ++j) {
      if (!std::isfinite(errors[k][j])) continue;
      Story& story = stories[measured.frames[k].points[j]];
      if (!story.first) story.first = story.good = k;
      story.last = k;
      if (!(std::abs(errors[k][j]) < kClose)) story.good = k + 1;
    }
  }
  double worst = kUnknown;
  for (const Story& story : stories) {
    if (!story.first) continue;
    if (story.good > story.last) return kUnknown;
    worst = std::fmax(worst, static_cast<double>(story.good - *story.first));
  }
  return worst;
}

double secondsPerImage(const Measured& measured, EstimatorKind kind) {
  using Clock = std::chrono::steady_clock;
  double fastest = kUnknown;
  for (int pass = 0; pass < kTimedPasses; ++pass) {
    MeasuredRun run(measured, kind);
    const auto begin = Clock::now();
    for (std::size_t k = 0; k < measured.frames.size(); ++k) run.advance();
    const std::chrono::duration<double> total = Clock::now() - begin;
    fastest = std::fmin(fastest, total.count() / static_cast<double>(measured.frames.size()));
  }
  return fastest;
}

/// How honest a sigma is.
struct Honesty {
  int judged = 0, covered = 0;
  double nees = 0;

  void judge(const DepthEstimate& estimate, double chiTrue) {
    const bool claimsDepth =
        estimate.status == DepthStatus::valid || estimate.status == DepthStatus::converging;
    if (!claimsDepth || !(estimate.sigma_chi > 0)) return;
    const double e = (estimate.chi - chiTrue) / estimate.sigma_chi;
    ++judged;
    covered += std::abs(e) <= 2 ? 1 : 0;
    nees += e * e;
  }
  double coverage() const { return judged > 0 ? static_cast<double>(covered) / judged : kUnknown; }
  double meanNees() const { return judged > 0 ? nees / judged : kUnknown; }
};

/// The depths of one estimator and how good they are. \param Z its depths
ComparedEstimator observe(const Measured& measured, EstimatorKind kind, PointTable& Z) {
  MeasuredRun run(measured, kind);
  PointTable errors = unknownTable(measured);
  Z = errors;
  Honesty honesty;
  ComparedEstimator result;
  result.name = toString(kind);
  for (std::size_t k = 0; k < measured.frames.size(); ++k) {
    const MeasuredFrame& frame = measured.frames[k];
    run.advance();
    FrameStatistics ofZ, ofChi, sigmas;
    for (std::size_t j = 0; j < frame.points.size(); ++j) {
      const DepthEstimate estimate = run.estimate(frame.points[j]);
      if (estimate.status == DepthStatus::unset) continue;
      const bool isOld = measured.isOld(frame.points[j], k);
      Z[k][j] = estimate.Z();
      sigmas.add(estimate.sigma_chi / estimate.chi, isOld);
      const double chiTrue = frame.truth[j].chi;
      if (!std::isfinite(chiTrue)) continue;
      errors[k][j] = estimate.Z() * chiTrue - 1;
      ofZ.add(errors[k][j], isOld);
      ofChi.add(estimate.chi / chiTrue - 1, isOld);
      honesty.judge(estimate, chiTrue);
    }
    result.error.push_back(ofZ.rms());
    result.sigma.push_back(sigmas.rms());
    result.median_error.push_back(ofChi.median());
    result.within_5pct.push_back(ofChi.closeShare());
    result.median_sigma.push_back(sigmas.median());
  }
  result.frames_to_5pct = framesTo5pct(measured, errors);
  result.coverage_2sigma = honesty.coverage();
  result.mean_nees = honesty.meanNees();
  result.update_s = secondsPerImage(measured, kind);
  return result;
}

/// The camera's true motion to a frame from the one before; by the odometry where the poses are not
/// known.
std::optional<Motion> trueMotion(const Measured& measured, const MotionBuffer& odometry,
                                 std::size_t k) {
  const MeasuredFrame &before = measured.frames[k - 1], &now = measured.frames[k];
  const auto [told, coverage] = odometry.motion(before.time_s, now.time_s);
  const bool isTold = coverage == Coverage::complete;
  if (!before.wMc || !now.wMc) return isTold ? std::optional<Motion>(told) : std::nullopt;
  Motion motion = Motion::fromPoses(*before.wMc, *now.wMc, now.time_s - before.time_s);
  if (isTold) motion.dt2 = told.dt2;
  return motion;
}

/// The bound of these points together, from the first frame in which all are measured.
class Limit {
 public:
  Limit(const Measured& measured, std::vector<std::size_t> points)
      : measured_(measured), points_(std::move(points)) {}

  /// Advances to a frame and writes the relative sigmas.
  void follow(std::size_t k, const std::optional<Motion>& motion, std::vector<double>& relative) {
    const MeasuredFrame& frame = measured_.frames[k];
    if (k < firstFrame() || k > measured_.last[points_.front()]) return;
    if (bound_ && !motion) bound_.reset();
    if (bound_) bound_->advance(*motion, measured_.odometryNoise);
    if (!bound_ && !isBegun_ && canBegin(frame)) begin(frame);
    if (!bound_) return;
    for (std::size_t j = 0; j < points_.size(); ++j) {
      const PointMeasurement* measurement = frame.measurementOf(measured_.ids[points_[j]]);
      if (measurement) bound_->measure(j, measurement->sigma);
    }
    for (std::size_t j = 0; j < points_.size(); ++j) {
      const auto place = frame.placeOf(points_[j]);
      if (!place) continue;
      const double scale = measured_.errors ? 0 : measured_.odometryScaleSigma;  // else within it
      relative[*place] = std::hypot(bound_->relativeSigma(j), scale);
    }
  }

 private:
  std::size_t firstFrame() const { return measured_.first[points_.front()]; }
  bool canBegin(const MeasuredFrame& frame) const {
    return std::all_of(points_.begin(), points_.end(), [&](std::size_t point) {
      const auto place = frame.placeOf(point);
      return place && std::isfinite(frame.truth[*place].chi) &&
             frame.measurementOf(measured_.ids[point]);
    });
  }
  void begin(const MeasuredFrame& frame) {
    std::vector<PointState> start;
    for (const std::size_t point : points_) start.push_back(frame.truth[*frame.placeOf(point)]);
    bound_.emplace(start, std::numeric_limits<double>::infinity(),
                   measured_.errors.value_or(ErrorProfile()), measured_.focal_px);
    isBegun_ = true;
  }

  const Measured& measured_;
  std::vector<std::size_t> points_;
  std::optional<CramerRaoBound> bound_;
  bool isBegun_ = false;
};

ComparedEstimator limitOf(const Measured& measured, const std::string& name,
                          std::vector<Limit> limits) {
  PointTable relative = unknownTable(measured);
  const MotionBuffer odometry = measured.odometry();
  ComparedEstimator result;
  result.name = name;
  for (std::size_t k = 0; k < measured.frames.size(); ++k) {
    const auto motion = k > 0 ? trueMotion(measured, odometry, k) : std::nullopt;
    for (Limit& limit : limits) limit.follow(k, motion, relative[k]);
    FrameStatistics statistics;
    for (std::size_t j = 0; j < relative[k].size(); ++j) {
      statistics.add(relative[k][j], measured.isOld(measured.frames[k].points[j], k));
    }
    result.error.push_back(statistics.rms());
    result.median_error.push_back(statistics.median());
  }
  result.frames_to_5pct = framesTo5pct(measured, relative);
  return result;
}

std::vector<ComparedEstimator> limitsOf(const Measured& measured) {
  if (!measured.isTargetStill) return {};
  std::vector<std::size_t> all;
  std::vector<Limit> alone;
  for (std::size_t i = 0; i < measured.ids.size(); ++i) {
    all.push_back(i);
    alone.emplace_back(measured, std::vector<std::size_t>{i});
  }
  std::vector<ComparedEstimator> limits{limitOf(measured, "limit", std::move(alone))};
  const MeasuredFrame& first = measured.frames.front();
  if (all.size() > 1 && all.size() <= kMostJoint && first.observations.size() == all.size()) {
    limits.push_back(limitOf(measured, "joint-limit", {Limit(measured, all)}));
  }
  return limits;
}

/// 0.5, 1, 2, 5, 10, ... s as far as the data reach.
std::vector<double> usualTimes(double duration_s) {
  std::vector<double> times;
  for (double decade = 0.1; decade < duration_s; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (step * decade < 0.9 * duration_s) times.push_back(step * decade);
    }
  }
  if (times.size() > kMostColumns - 1) {
    times.erase(times.begin(), times.end() - static_cast<std::ptrdiff_t>(kMostColumns - 1));
  }
  return times;
}

std::vector<std::size_t> shownFrames(const std::vector<double>& time_s,
                                     const CompareOptions& options) {
  const std::vector<double> times =
      options.times_s.empty() ? usualTimes(time_s.back()) : options.times_s;
  std::set<std::size_t> shown{time_s.size() - 1};
  for (const double t : times) {
    if (!(t >= 0 && t <= time_s.back() + kSameInstant_s)) {
      throw InputError({"--times", 0, ""}, fmt::format("{:g} s is not within the data, which last "
                                                       "{:.6g} s",
                                                       t, time_s.back()));
    }
    const auto at = std::lower_bound(time_s.begin(), time_s.end(), t - kSameInstant_s);
    shown.insert(static_cast<std::size_t>(at - time_s.begin()));
  }
  return {shown.begin(), shown.end()};
}

/// As asked for, or every one that can be used on these data.
std::vector<EstimatorKind> chosenEstimators(const Measured& measured,
                                            const CompareOptions& options) {
  if (!options.estimators.empty()) return options.estimators;
  std::vector<EstimatorKind> usable;
  for (const auto& [kind, word] : estimatorWords()) {
    if (kind == EstimatorKind::trueDepth) continue;
    try {
      measured.setup(kind);
      usable.push_back(kind);
    } catch (const InputError&) {
      continue;  // needs what these data do not have, such as a known target
    }
  }
  return usable;
}

void subtractReference(const Measured& measured, const std::vector<PointTable>& Z,
                       Comparison& comparison) {
  std::size_t reference = 0;
  for (std::size_t e = 0; e < comparison.estimators.size(); ++e) {
    if (comparison.estimators[e].name == toString(EstimatorKind::filter)) reference = e;
  }
  comparison.reference = comparison.estimators[reference].name;
  for (std::size_t e = 0; e < comparison.estimators.size(); ++e) {
    ComparedEstimator& one = comparison.estimators[e];
    for (std::size_t k = 0; k < measured.frames.size(); ++k) {
      FrameStatistics ofZ, ofChi;
      for (std::size_t j = 0; j < Z[e][k].size(); ++j) {
        const bool isOld = measured.isOld(measured.frames[k].points[j], k);
        ofZ.add(Z[e][k][j] / Z[reference][k][j] - 1, isOld);
        ofChi.add(Z[reference][k][j] / Z[e][k][j] - 1, isOld);
      }
      one.difference.push_back(ofZ.rms());
      one.median_difference.push_back(ofChi.median());
    }
  }
}

Comparison compareOn(const Measured& measured, const CompareOptions& options,
                     const std::string& place) {
  if (measured.frames.empty() || measured.ids.empty()) {
    throw InputError({place, 0, ""}, "no point was measured in it: there is nothing to compare");
  }
  Comparison comparison;
  comparison.name = measured.name;
  comparison.points = measured.ids.size();
  comparison.pointsComeAndGo = measured.pointsComeAndGo;
  comparison.hasTruth = measured.hasTruth();
  comparison.pixelNoise_px = measured.pixelNoise_px;
  for (const MeasuredFrame& frame : measured.frames) {
    comparison.time_s.push_back(frame.time_s - measured.frames.front().time_s);
  }
  comparison.shown = shownFrames(comparison.time_s, options);
  std::vector<PointTable> Z;
  for (const EstimatorKind kind : chosenEstimators(measured, options)) {
    Z.emplace_back();
    comparison.estimators.push_back(observe(measured, kind, Z.back()));
  }
  subtractReference(measured, Z, comparison);
  if (comparison.hasTruth) comparison.limits = limitsOf(measured);
  return comparison;
}

/// Keeps what a run shows beside its log.
class Witness : public RunWatcher {
 public:
  explicit Witness(RunWatcher* next) : next_(next) {}

  bool onFrame(const RunFrame& frame) override {
    poses_.push_back(*frame.exposure.wMc);
    rows_ = frame.rig.odometry();
    return !next_ || next_->onFrame(frame);
  }
  const std::vector<Eigen::Isometry3d>& poses() const { return poses_; }
  const std::vector<OdometryRow>& rows() const { return rows_; }

 private:
  RunWatcher* next_;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<OdometryRow> rows_;
};

void refuseTruth(const CompareOptions& options) {
  for (const EstimatorKind kind : options.estimators) {
    if (kind == EstimatorKind::trueDepth) {
      throw InputError({"--estimators", 0, ""},
                       "'true' is told the depths it would be compared with; leave it out");
    }
  }
}

/// What both kinds of sources have in common. \param source and \param observation outlive it
Measured measuredOf(const ObservedSource& source, const ObservationOptions& observation) {
  Measured measured;
  measured.nominalPeriod_s = source.rowPeriod_s;
  measured.prior = observation.prior();
  measured.odometryNoise = observation.odometryNoise.value_or(OdometryNoise());
  measured.odometryScaleSigma = observation.odometryScaleSigma;
  measured.errors = errorsOf(observation);
  measured.focal_px = source.camera.focal_px();
  if (measured.errors) measured.odometryNoise = measured.errors->odometry;
  measured.setup = [&](EstimatorKind kind) {
    ObservationOptions other = observation;
    other.depth.estimator = kind;
    return setupOf(source, other);
  };
  return measured;
}

}  // namespace

Comparison compare(const Scenario& scenario, const CompareOptions& options, RunWatcher* watcher) {
  refuseTruth(options);
  Witness witness(watcher);
  const RunLog log = run(scenario, &witness);
  const SimulatedRig rig(scenario, scenario.file);
  const ObservationOptions observation = withTracker(rig.source(), observationOf(scenario, rig));
  Measured measured = measuredOf(rig.source(), observation);
  measured.name = scenario.name;
  measured.rows = witness.rows();
  measured.meaning = log.rows;
  measured.isTargetStill = scenario.target.twist.empty();
  measured.read(log);
  for (std::size_t k = 0; k < measured.frames.size(); ++k) {
    measured.frames[k].wMc = witness.poses()[k];
  }
  return compareOn(measured, options, scenario.file);
}

Comparison compare(const Sequence& sequence, const ObservationOptions& asked,
                   const CompareOptions& options, RunWatcher* watcher) {
  refuseTruth(options);
  const RunLog log = replay(sequence, asked, watcher);
  const ObservedSource source = ObservedSource::of(sequence);
  const ObservationOptions observation = withTracker(source, asked);
  Measured measured = measuredOf(source, observation);
  measured.name = sequence.name();
  measured.rows = log.odometry;
  measured.meaning = log.rows;
  measured.read(log);
  auto pose = sequence.poses().begin();
  for (MeasuredFrame& frame : measured.frames) {
    while (pose != sequence.poses().end() && pose->time_s < frame.time_s - kSameInstant_s) ++pose;
    if (pose == sequence.poses().end()) break;
    if (pose->time_s <= frame.time_s + kSameInstant_s) frame.wMc = pose->wMc;
  }
  return compareOn(measured, options, sequence.folder());
}

}  // namespace depthservo
