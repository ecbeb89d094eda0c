#include "depthservo/observation/UnexcitedPeriods.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>

namespace depthservo {

void UnexcitedPeriods::end(Point& point) {
  if (point.isIn && point.period.duration_s() >= kUnexcitedFor_s) ended_.push_back(point.period);
  point.isIn = false;
}

void UnexcitedPeriods::add(const FrameRecord& frame) {
  if (frames_ > 0) excitation_.add(Motion::fromTwist(frame.twist, frame.time_s - last_s_));
  last_s_ = frame.time_s;
  ++frames_;
  for (const FeatureRecord& feature : frame.features) {
    Point& point = points_[feature.id];
    point.frame = frames_;
    const DepthEstimate& estimate = feature.estimate;
    if (estimate.status != DepthStatus::unexcited) {
      end(point);
      continue;
    }
    if (!point.isIn) point.period = {feature.id, frame.time_s, frame.time_s, ""};
    point.isIn = true;
    if (point.period.duration_s() < kUnexcitedFor_s) {
      point.period.because = describe(excitation_.ofDepth(estimate.x, estimate.y), feature.id);
    }
    point.period.end_s = frame.time_s;
  }
  for (auto point = points_.begin(); point != points_.end();) {
    if (point->second.frame == frames_) {
      ++point;
      continue;
    }
    end(point->second);
    point = points_.erase(point);
  }
}

std::vector<UnexcitedPeriod> UnexcitedPeriods::takeEnded() { return std::exchange(ended_, {}); }

const UnexcitedPeriod* UnexcitedPeriods::current(int point) const {
  const auto found = points_.find(point);
  const bool isIn = found != points_.end() && found->second.isIn;
  return isIn && found->second.period.duration_s() >= kUnexcitedFor_s ? &found->second.period
                                                                      : nullptr;
}

std::vector<UnexcitedPeriod> UnexcitedPeriods::current() const {
  std::vector<UnexcitedPeriod> all;
  for (const auto& [id, point] : points_) {
    if (const UnexcitedPeriod* period = current(id)) all.push_back(*period);
  }
  return all;
}

std::vector<UnexcitedPeriod> unexcitedPeriods(const RunLog& log) {
  UnexcitedPeriods all;
  for (const FrameRecord& frame : log.frames) all.add(frame);
  std::vector<UnexcitedPeriod> periods = all.takeEnded();
  for (UnexcitedPeriod& period : all.current()) periods.push_back(std::move(period));
  std::stable_sort(periods.begin(), periods.end(),
                   [](const auto& a, const auto& b) { return a.begin_s < b.begin_s; });
  return periods;
}

void addUnexcitedEvents(RunLog& log) {
  if (!log.isDepthObserved) return;
  const std::vector<UnexcitedPeriod> periods = unexcitedPeriods(log);
  for (auto first = periods.begin(); first != periods.end();) {
    std::map<std::string, std::vector<int>> points;
    const double begin_s = first->begin_s;
    for (; first != periods.end() && first->begin_s == begin_s; ++first) {
      points[first->because].push_back(first->point);
    }
    for (const auto& [because, ids] : points) {
      log.events.push_back({begin_s, fmt::format("unexcited: {} (point{} {})", because,
                                                 ids.size() > 1 ? "s" : "", fmt::join(ids, ", "))});
    }
  }
  std::stable_sort(log.events.begin(), log.events.end(),
                   [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
}

}  // namespace depthservo
