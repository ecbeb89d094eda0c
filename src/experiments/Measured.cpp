#include "experiments/Measured.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace depthservo {
namespace {

constexpr double kOld_s = 1, kTimeSlack_s = 1e-6;

std::size_t mostAtOnce(const Measured& measured) {
  std::size_t most = 0;
  for (const MeasuredFrame& frame : measured.frames) most = std::max(most, frame.points.size());
  return most;
}

}  // namespace

const PointMeasurement* MeasuredFrame::measurementOf(int id) const {
  const auto found = std::find_if(observations.begin(), observations.end(),
                                  [id](const PointObservation& o) { return o.id == id; });
  return found == observations.end() ? nullptr : &found->measurement;
}

std::optional<std::size_t> MeasuredFrame::placeOf(std::size_t point) const {
  const auto found = std::lower_bound(points.begin(), points.end(), point);
  if (found == points.end() || *found != point) return std::nullopt;
  return static_cast<std::size_t>(found - points.begin());
}

void Measured::read(const RunLog& log) {
  std::set<int> all;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) all.insert(feature.id);
  }
  ids.assign(all.begin(), all.end());
  first.assign(ids.size(), log.frames.size());
  last.assign(ids.size(), 0);
  std::set<double> noises_px;
  for (const FrameRecord& record : log.frames) {
    MeasuredFrame frame;
    frame.time_s = record.time_s;
    for (const FeatureRecord& feature : record.features) {
      const auto place = std::lower_bound(ids.begin(), ids.end(), feature.id);
      const auto point = static_cast<std::size_t>(place - ids.begin());
      first[point] = std::min(first[point], frames.size());
      last[point] = frames.size();
      const Eigen::Vector2d s = log.camera.normalise(feature.u, feature.v);
      if (feature.measured) {
        noises_px.insert(feature.sigma_px);
        const double sigma = feature.sigma_px / log.camera.focal_px(s.x(), s.y());
        frame.observations.push_back({feature.id, {s.x(), s.y(), sigma}});
      }
      const bool isSeenTruly = std::isfinite(feature.u_true) && std::isfinite(feature.v_true);
      const Eigen::Vector2d seen =
          isSeenTruly ? log.camera.normalise(feature.u_true, feature.v_true) : s;
      frame.points.push_back(point);
      frame.truth.push_back(
          {seen.x(), seen.y(), feature.Z_true > 0 ? 1 / feature.Z_true : kUnknown});
    }
    frames.push_back(std::move(frame));
  }
  if (noises_px.size() == 1) pixelNoise_px = *noises_px.begin();
  pointsComeAndGo = std::any_of(last.begin(), last.end(),
                                [&](std::size_t frame) { return frame + 1 < frames.size(); });
}

MotionBuffer Measured::odometry() const {
  MotionBuffer buffer(rows.size(), nominalPeriod_s);
  buffer.setMeaning(meaning);
  for (const OdometryRow& row : rows) buffer.push(row.time_s, row.twist);
  if (!rows.empty()) buffer.holdUntil(frames.back().time_s);
  return buffer;
}

bool Measured::hasTruth() const {
  return std::any_of(frames.begin(), frames.end(), [](const MeasuredFrame& frame) {
    return std::any_of(frame.truth.begin(), frame.truth.end(),
                       [](const PointState& point) { return std::isfinite(point.chi); });
  });
}

bool Measured::isOld(std::size_t point, std::size_t frame) const {
  return frames[frame].time_s - frames[first[point]].time_s >= kOld_s - kTimeSlack_s;
}

PointTable unknownTable(const Measured& measured) {
  PointTable table;
  for (const MeasuredFrame& frame : measured.frames) {
    table.emplace_back(frame.points.size(), kUnknown);
  }
  return table;
}

MeasuredRun::MeasuredRun(const Measured& measured, EstimatorKind kind)
    : measured_(measured),
      odometry_(measured.odometry()),
      estimator_(makeEstimator(measured.setup(kind), measured.pointsComeAndGo
                                                         ? mostAtOnce(measured)
                                                         : measured.ids.size())) {
  if (measured.pointsComeAndGo) return;
  for (const int id : measured.ids) estimator_->setPrior(id, measured.prior);
}

void MeasuredRun::advance() {
  const MeasuredFrame& frame = measured_.frames[next_];
  if (measured_.pointsComeAndGo) renewPoints(frame);
  const Coverage coverage = estimator_->advance(odometry_, frame.time_s);
  if (coverage != Coverage::afterEnd && coverage != Coverage::reversed) {
    estimator_->correct(frame.observations);
  }
  ++next_;
}

/// As the observer does: points are forgotten when their tracker is done with them.
void MeasuredRun::renewPoints(const MeasuredFrame& frame) {
  if (next_ > 0) {
    for (const std::size_t point : measured_.frames[next_ - 1].points) {
      if (measured_.last[point] + 1 == next_) estimator_->retire(measured_.ids[point]);
    }
  }
  for (const std::size_t point : frame.points) {
    if (measured_.first[point] == next_)
      estimator_->setPrior(measured_.ids[point], measured_.prior);
  }
}

DepthEstimate MeasuredRun::estimate(std::size_t point) const {
  return estimator_->estimate(measured_.ids[point]);
}

}  // namespace depthservo
