#include "depthservo/experiments/Compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "depthservo/depth/CramerRaoBound.h"
#include "depthservo/text/NewFolder.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "observation/ObserverSetup.h"
#include "report/Html.h"
#include "report/RunFiles.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// By frame and point.
using Table = std::vector<std::vector<double>>;

constexpr double kClose = 0.05;          // relative error of a depth that counts as good
constexpr std::size_t kMostColumns = 6;  // times that are shown unless the user names some
constexpr int kTimedPasses = 3;          // the fastest counts
constexpr double kSameInstant_s = 1e-6;
constexpr std::size_t kMostJoint = 16;  // points of the joint limit: it costs their number cubed

struct MeasuredFrame {
  double time_s = 0;
  std::vector<PointObservation> observations;
  std::vector<PointState> truth;         ///< by point; chi is NaN when unknown
  std::optional<Eigen::Isometry3d> wMc;  ///< true pose of the camera, if known
};

/// What every estimator is given, and the truth.
struct Measured {
  std::string name;
  double pixelNoise_px = kUnknown;  ///< if it is the same for all points
  std::vector<int> ids;
  std::vector<MeasuredFrame> frames;
  std::vector<OdometryRow> rows;
  double nominalPeriod_s = 0;  ///< of the rows
  DepthPrior prior;
  OdometryNoise odometryNoise;
  double odometryScaleSigma = 0;
  bool isTargetStill = true;
  std::function<EstimatorSetup(EstimatorKind)> setup;

  std::size_t points() const { return ids.size(); }

  MotionBuffer odometry() const {
    MotionBuffer buffer(rows.size(), nominalPeriod_s);
    for (const OdometryRow& row : rows) buffer.push(row.time_s, row.twist);
    if (!rows.empty()) buffer.holdUntil(frames.back().time_s);
    return buffer;
  }
};

/// The measurements of a log; true poses are left to the caller.
void readLog(const RunLog& log, Measured& measured) {
  std::set<int> ids;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) ids.insert(feature.id);
  }
  measured.ids.assign(ids.begin(), ids.end());
  std::set<double> noises_px;
  for (const FrameRecord& record : log.frames) {
    MeasuredFrame frame;
    frame.time_s = record.time_s;
    frame.truth.assign(measured.ids.size(), {kUnknown, kUnknown, kUnknown});
    for (const FeatureRecord& feature : record.features) {
      const Eigen::Vector2d s = log.camera.normalise(feature.u, feature.v);
      if (feature.measured) {
        noises_px.insert(feature.sigma_px);
        const double sigma = feature.sigma_px / log.camera.focal_px(s.x(), s.y());
        frame.observations.push_back({feature.id, {s.x(), s.y(), sigma}});
      }
      if (!(feature.Z_true > 0)) continue;
      const auto i = static_cast<std::size_t>(std::distance(ids.begin(), ids.find(feature.id)));
      const bool isSeenTruly = std::isfinite(feature.u_true) && std::isfinite(feature.v_true);
      const Eigen::Vector2d place =
          isSeenTruly ? log.camera.normalise(feature.u_true, feature.v_true) : s;
      frame.truth[i] = {place.x(), place.y(), 1 / feature.Z_true};
    }
    measured.frames.push_back(std::move(frame));
  }
  if (noises_px.size() == 1) measured.pixelNoise_px = *noises_px.begin();
}

/// The measurement of a point; none: it is hidden.
const PointMeasurement* measurementOf(const MeasuredFrame& frame, int id) {
  const auto found = std::find_if(frame.observations.begin(), frame.observations.end(),
                                  [id](const PointObservation& o) { return o.id == id; });
  return found == frame.observations.end() ? nullptr : &found->measurement;
}

double rms(const std::vector<double>& values) {
  double squares = 0;
  int n = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    squares += value * value;
    ++n;
  }
  return n > 0 ? std::sqrt(squares / n) : kUnknown;
}

std::vector<double> rmsByFrame(const Table& table) {
  std::vector<double> values;
  values.reserve(table.size());
  for (const auto& row : table) values.push_back(rms(row));
  return values;
}

/// Frames from each point's first known error until the error stays small; greatest of the points.
double framesTo5pct(const Table& errors) {
  double worst = kUnknown;
  for (std::size_t i = 0; !errors.empty() && i < errors.front().size(); ++i) {
    std::size_t first = errors.size(), good = 0;
    for (std::size_t k = 0; k < errors.size(); ++k) {
      if (!std::isfinite(errors[k][i])) continue;
      first = std::min(first, k);
      if (!(std::abs(errors[k][i]) < kClose)) good = k + 1;
    }
    if (first == errors.size()) continue;
    if (good == errors.size()) return kUnknown;
    worst = std::fmax(worst, static_cast<double>(std::max(good, first) - first));
  }
  return worst;
}

std::unique_ptr<PointSetEstimator> estimatorFor(const Measured& measured, EstimatorKind kind) {
  auto estimator = makeEstimator(measured.setup(kind), measured.points());
  for (const int id : measured.ids) estimator->setPrior(id, measured.prior);
  return estimator;
}

void advance(PointSetEstimator& estimator, const MotionBuffer& odometry,
             const MeasuredFrame& frame) {
  const Coverage coverage = estimator.advance(odometry, frame.time_s);
  if (coverage != Coverage::afterEnd && coverage != Coverage::reversed) {
    estimator.correct(frame.observations);
  }
}

double secondsPerImage(const Measured& measured, EstimatorKind kind) {
  using Clock = std::chrono::steady_clock;
  const MotionBuffer odometry = measured.odometry();
  double fastest = kUnknown;
  for (int pass = 0; pass < kTimedPasses; ++pass) {
    const auto estimator = estimatorFor(measured, kind);
    const auto begin = Clock::now();
    for (const MeasuredFrame& frame : measured.frames) advance(*estimator, odometry, frame);
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

/// One estimator over all frames. \param Z its depths, by frame and point
ComparedEstimator observe(const Measured& measured, EstimatorKind kind, Table& Z) {
  const std::size_t frames = measured.frames.size(), points = measured.points();
  const MotionBuffer odometry = measured.odometry();
  const auto estimator = estimatorFor(measured, kind);
  Table errors(frames, std::vector<double>(points, kUnknown)), sigmas = errors;
  Z = errors;
  Honesty honesty;
  for (std::size_t k = 0; k < frames; ++k) {
    const MeasuredFrame& frame = measured.frames[k];
    advance(*estimator, odometry, frame);
    for (std::size_t i = 0; i < points; ++i) {
      const DepthEstimate estimate = estimator->estimate(measured.ids[i]);
      if (estimate.status == DepthStatus::unset) continue;
      Z[k][i] = estimate.Z();
      sigmas[k][i] = estimate.sigma_chi / estimate.chi;
      const double chiTrue = frame.truth[i].chi;
      if (!std::isfinite(chiTrue)) continue;
      errors[k][i] = estimate.Z() * chiTrue - 1;
      honesty.judge(estimate, chiTrue);
    }
  }
  ComparedEstimator result;
  result.name = toString(kind);
  result.error = rmsByFrame(errors);
  result.sigma = rmsByFrame(sigmas);
  result.frames_to_5pct = framesTo5pct(errors);
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
    if (bound_ && !motion) bound_.reset();
    if (bound_) bound_->advance(*motion, measured_.odometryNoise);
    if (!bound_ && !isBegun_ && canBegin(frame)) begin(frame);
    if (!bound_) return;
    for (std::size_t j = 0; j < points_.size(); ++j) {
      const PointMeasurement* measurement = measurementOf(frame, measured_.ids[points_[j]]);
      if (measurement) bound_->measure(j, measurement->sigma);
    }
    for (std::size_t j = 0; j < points_.size(); ++j) {
      relative[points_[j]] = std::hypot(bound_->relativeSigma(j), measured_.odometryScaleSigma);
    }
  }

 private:
  bool canBegin(const MeasuredFrame& frame) const {
    return std::all_of(points_.begin(), points_.end(), [&](std::size_t i) {
      return std::isfinite(frame.truth[i].chi) && measurementOf(frame, measured_.ids[i]);
    });
  }
  void begin(const MeasuredFrame& frame) {
    std::vector<PointState> start;
    for (const std::size_t i : points_) start.push_back(frame.truth[i]);
    bound_.emplace(start, std::numeric_limits<double>::infinity());
    isBegun_ = true;
  }

  const Measured& measured_;
  std::vector<std::size_t> points_;
  std::optional<CramerRaoBound> bound_;
  bool isBegun_ = false;
};

ComparedEstimator limitOf(const Measured& measured, const std::string& name,
                          std::vector<Limit> limits) {
  Table relative(measured.frames.size(), std::vector<double>(measured.points(), kUnknown));
  const MotionBuffer odometry = measured.odometry();
  for (std::size_t k = 0; k < measured.frames.size(); ++k) {
    const auto motion = k > 0 ? trueMotion(measured, odometry, k) : std::nullopt;
    for (Limit& limit : limits) limit.follow(k, motion, relative[k]);
  }
  ComparedEstimator result;
  result.name = name;
  result.error = rmsByFrame(relative);
  result.frames_to_5pct = framesTo5pct(relative);
  return result;
}

std::vector<ComparedEstimator> limitsOf(const Measured& measured) {
  if (!measured.isTargetStill) return {};
  std::vector<std::size_t> all;
  std::vector<Limit> alone;
  for (std::size_t i = 0; i < measured.points(); ++i) {
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
  for (const EstimatorKind kind :
       {EstimatorKind::constant, EstimatorKind::twoFrame, EstimatorKind::nonlinear,
        EstimatorKind::window, EstimatorKind::filter, EstimatorKind::joint, EstimatorKind::pose}) {
    try {
      estimatorNamed(toString(kind), {});
      measured.setup(kind);
      usable.push_back(kind);
    } catch (const InputError&) {
      continue;  // needs what these data do not have, such as a known target
    }
  }
  return usable;
}

void subtractReference(Comparison& comparison, const std::vector<Table>& Z) {
  std::size_t reference = 0;
  for (std::size_t e = 0; e < comparison.estimators.size(); ++e) {
    if (comparison.estimators[e].name == toString(EstimatorKind::filter)) reference = e;
  }
  comparison.reference = comparison.estimators[reference].name;
  for (std::size_t e = 0; e < comparison.estimators.size(); ++e) {
    Table relative = Z[e];
    for (std::size_t k = 0; k < relative.size(); ++k) {
      for (std::size_t i = 0; i < relative[k].size(); ++i) {
        relative[k][i] = relative[k][i] / Z[reference][k][i] - 1;
      }
    }
    comparison.estimators[e].difference = rmsByFrame(relative);
  }
}

Comparison compareOn(const Measured& measured, const CompareOptions& options,
                     const std::string& place) {
  if (measured.frames.empty() || measured.ids.empty()) {
    throw InputError({place, 0, ""}, "no point was measured in it: there is nothing to compare");
  }
  Comparison comparison;
  comparison.name = measured.name;
  comparison.points = measured.points();
  comparison.pixelNoise_px = measured.pixelNoise_px;
  for (const MeasuredFrame& frame : measured.frames) {
    comparison.time_s.push_back(frame.time_s - measured.frames.front().time_s);
    for (const PointState& point : frame.truth) {
      comparison.hasTruth = comparison.hasTruth || std::isfinite(point.chi);
    }
  }
  comparison.shown = shownFrames(comparison.time_s, options);
  std::vector<Table> Z;
  for (const EstimatorKind kind : chosenEstimators(measured, options)) {
    Z.emplace_back();
    comparison.estimators.push_back(observe(measured, kind, Z.back()));
  }
  subtractReference(comparison, Z);
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

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json shownOf(const std::vector<double>& values, const std::vector<std::size_t>& shown) {
  Json json = Json::array();
  for (const std::size_t k : shown) {
    json.push_back(k < values.size() ? numberOrNull(values[k]) : Json());
  }
  return json;
}

std::string csvOf(const Comparison& comparison) {
  std::string csv = "time";
  const auto columns = [&](const char* kind, const std::vector<ComparedEstimator>& all) {
    for (const ComparedEstimator& one : all) csv += fmt::format(",{}_{}", kind, one.name);
  };
  const auto cell = [&](const std::vector<double>& values, std::size_t k) {
    csv += std::isfinite(values[k]) ? fmt::format(",{}", values[k]) : ",";
  };
  columns("error", comparison.estimators);
  columns("error", comparison.limits);
  columns("sigma", comparison.estimators);
  columns("difference", comparison.estimators);
  csv += '\n';
  for (std::size_t k = 0; k < comparison.time_s.size(); ++k) {
    csv += fmt::format("{:.9f}", comparison.time_s[k]);
    for (const auto& one : comparison.estimators) cell(one.error, k);
    for (const auto& one : comparison.limits) cell(one.error, k);
    for (const auto& one : comparison.estimators) cell(one.sigma, k);
    for (const auto& one : comparison.estimators) cell(one.difference, k);
    csv += '\n';
  }
  return csv;
}

constexpr const char* kNoFigure = "&ndash;";

/// One row of the page's table; the limit has no sigma of its own.
std::string pageRow(const ComparedEstimator& one, const std::vector<double>& values,
                    const Comparison& comparison) {
  std::string row = fmt::format("<tr><td>{}</td>", html::escaped(one.name));
  for (const std::size_t k : comparison.shown) {
    row += fmt::format("<td>{}</td>", percent(values[k], kNoFigure));
  }
  if (comparison.hasTruth) {
    row += std::isfinite(one.frames_to_5pct) ? fmt::format("<td>{:.0f}</td>", one.frames_to_5pct)
                                             : std::string("<td>never</td>");
    row += fmt::format("<td>{}</td>", percent(one.coverage_2sigma, kNoFigure));
    row += std::isfinite(one.mean_nees) ? fmt::format("<td>{:.3g}</td>", one.mean_nees)
                                        : std::string("<td>&ndash;</td>");
  }
  return row + "</tr>\n";
}

std::string pageTable(const Comparison& comparison, const std::string& caption,
                      std::vector<double> ComparedEstimator::*values, bool withHonesty) {
  Comparison shown = comparison;
  shown.hasTruth = withHonesty;
  std::string table = fmt::format("<h3>{}</h3><div class=\"scroll\"><table><tr><th></th>", caption);
  for (const std::size_t k : comparison.shown) {
    table += fmt::format("<th>{:.4g} s</th>", comparison.time_s[k]);
  }
  if (withHonesty) table += "<th>images to 5 %</th><th>within 2 sigma</th><th>mean NEES</th>";
  table += "</tr>\n";
  for (const auto& one : comparison.estimators) table += pageRow(one, one.*values, shown);
  if (withHonesty) {
    for (const auto& one : comparison.limits) table += pageRow(one, one.*values, shown);
  }
  return table + "</table></div>\n";
}

std::string pageOf(const Comparison& comparison, const Figure& figure, const fs::path& folder) {
  html::Sheet sheet;
  sheet.command = "compare";
  sheet.name = comparison.name;
  sheet.mood = "neutral";
  sheet.verdict = fmt::format("{} estimators on the same {} images", comparison.estimators.size(),
                              comparison.time_s.size());
  sheet.reason = fmt::format(
      "{} points, {:.4g} s, image noise told to the estimators {}.{}", comparison.points,
      comparison.time_s.back(),
      std::isfinite(comparison.pixelNoise_px) ? fmt::format("{:g} px", comparison.pixelNoise_px)
                                              : "as the tracker measures it",
      comparison.hasTruth ? ""
                          : " The true depths are not known: only what the estimators claim and "
                            "how far they differ can be compared.");
  const fs::path picture = folder / (figure.name + ".png");
  if (fs::exists(picture)) {
    sheet.body += fmt::format(
        R"(<figure><img alt="{0}" src="{1}"><figcaption>{2}</figcaption></figure>)",
        html::escaped(figure.title), html::pngSource(picture), html::escaped(figure.caption));
  }
  if (comparison.hasTruth) {
    sheet.body += pageTable(comparison, "Relative error of Z, rms over the points",
                            &ComparedEstimator::error, true);
  }
  sheet.body += pageTable(comparison, "sigma of Z claimed, relative, rms over the points",
                          &ComparedEstimator::sigma, false);
  sheet.body += pageTable(
      comparison, fmt::format("Difference of Z from {}, relative, rms", comparison.reference),
      &ComparedEstimator::difference, false);
  return sheet.page();
}

Curve curveOf(const Comparison& comparison, const std::string& title,
              const std::vector<double>& values) {
  Curve curve = Curve::named(title);
  curve.x = comparison.time_s;
  for (const double value : values) curve.y.push_back(100 * value);
  return curve;
}

Panel panelOf(const Comparison& comparison, const std::string& title,
              std::vector<double> ComparedEstimator::*values) {
  Panel panel = Panel::labelled(title, "time [s]", "relative, rms over the points [%]");
  panel.logY = true;
  double low = 1e9, high = 0;
  for (const ComparedEstimator& one : comparison.estimators) {
    panel.curves.push_back(curveOf(comparison, one.name, one.*values));
  }
  for (const ComparedEstimator& one : comparison.limits) {
    panel.curves.push_back(curveOf(comparison, one.name, one.error));
    panel.curves.back().colour = Curve::kBlack;
    panel.curves.back().style =
        &one == &comparison.limits.front() ? Curve::Style::line : Curve::Style::dashed;
  }
  for (const Curve& curve : panel.curves) {
    for (const double y : curve.y) {
      if (!(y > 0)) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  panel.yRange = {std::max(low, 1e-3), std::min(std::max(high, 2 * low), 1e3)};
  return panel;
}

}  // namespace

namespace {

/// What both kinds of sources have in common. \param source and \param observation outlive it
Measured measuredOf(const ObservedSource& source, const ObservationOptions& observation) {
  Measured measured;
  measured.nominalPeriod_s = source.rowPeriod_s;
  measured.prior = observation.prior();
  measured.odometryNoise = observation.odometryNoise.value_or(OdometryNoise());
  measured.odometryScaleSigma = observation.odometryScaleSigma;
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
  measured.isTargetStill = scenario.target.twist.empty();
  readLog(log, measured);
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
  readLog(log, measured);
  auto pose = sequence.poses().begin();
  for (MeasuredFrame& frame : measured.frames) {
    while (pose != sequence.poses().end() && pose->time_s < frame.time_s - kSameInstant_s) ++pose;
    if (pose == sequence.poses().end()) break;
    if (pose->time_s <= frame.time_s + kSameInstant_s) frame.wMc = pose->wMc;
  }
  return compareOn(measured, options, sequence.folder());
}

std::string toJson(const Comparison& comparison) {
  Json json = {{"command", "compare"},
               {"name", comparison.name},
               {"images", comparison.time_s.size()},
               {"points", comparison.points},
               {"pixel_noise", numberOrNull(comparison.pixelNoise_px)},
               {"truth", comparison.hasTruth},
               {"reference", comparison.reference}};
  json["times"] = shownOf(comparison.time_s, comparison.shown);
  json["estimators"] = Json::array();
  for (const ComparedEstimator& one : comparison.estimators) {
    json["estimators"].push_back({{"estimator", one.name},
                                  {"relative_error", shownOf(one.error, comparison.shown)},
                                  {"relative_sigma", shownOf(one.sigma, comparison.shown)},
                                  {"difference", shownOf(one.difference, comparison.shown)},
                                  {"frames_to_5pct", numberOrNull(one.frames_to_5pct)},
                                  {"coverage_2sigma", numberOrNull(one.coverage_2sigma)},
                                  {"mean_nees", numberOrNull(one.mean_nees)}});
  }
  json["limits"] = Json::array();
  for (const ComparedEstimator& one : comparison.limits) {
    json["limits"].push_back({{"limit", one.name},
                              {"relative_sigma", shownOf(one.error, comparison.shown)},
                              {"frames_to_5pct", numberOrNull(one.frames_to_5pct)}});
  }
  return json.dump(2);
}

std::string percent(double share, const std::string& unknown) {
  if (!std::isfinite(share)) return unknown;
  const bool isPlain = 100 * share < 1000 || 100 * share >= 1e6;
  return isPlain ? fmt::format("{:.3g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

const ComparedEstimator& costReference(const Comparison& comparison) {
  for (const EstimatorKind kind : {EstimatorKind::nonlinear, EstimatorKind::constant}) {
    for (const ComparedEstimator& one : comparison.estimators) {
      if (one.name == toString(kind)) return one;
    }
  }
  return comparison.estimators.front();
}

std::string timingJson(const Comparison& comparison) {
  const ComparedEstimator& reference = costReference(comparison);
  Json json = {{"reference", reference.name}, {"points", comparison.points}};
  json["estimators"] = Json::object();
  for (const ComparedEstimator& one : comparison.estimators) {
    json["estimators"][one.name] = {{"per_image_s", one.update_s},
                                    {"ratio", one.update_s / reference.update_s}};
  }
  return json.dump(2);
}

Figure figureOf(const Comparison& comparison) {
  Figure figure;
  figure.name = "errors";
  figure.title = fmt::format("{}: estimators on identical measurements", comparison.name);
  figure.columns = 2;
  if (comparison.hasTruth) {
    figure.panels.push_back(panelOf(comparison, "error of Z", &ComparedEstimator::error));
    figure.caption =
        "Left: relative errors of Z. Right: what the estimators claim, one sigma. Black: the "
        "Cramer-Rao bound, which no unbiased estimator that starts without knowledge can be below "
        "on "
        "average; dashed for estimators that take all points together.";
  } else {
    figure.panels.push_back(panelOf(comparison, "difference of Z from " + comparison.reference,
                                    &ComparedEstimator::difference));
    figure.caption =
        "The true depths are not known. Left: how far the estimators differ. Right: what they "
        "claim, "
        "one sigma.";
  }
  figure.panels.push_back(panelOf(comparison, "sigma of Z claimed", &ComparedEstimator::sigma));
  return figure;
}

bool writeComparison(const Comparison& comparison, const fs::path& folder) {
  bool isDrawn = false;
  makeFolder(folder, [&](const fs::path& place) {
    const Figure figure = figureOf(comparison);
    isDrawn = drawFigure(figure, place / (figure.name + ".png"));
    writeFile(place / "compare.json", toJson(comparison) + '\n');
    writeFile(place / "compare.csv", csvOf(comparison));
    writeFile(place / "timing.json", timingJson(comparison) + '\n');
    writeFile(place / "report.html", pageOf(comparison, figure, place));
  });
  return isDrawn;
}

}  // namespace depthservo
