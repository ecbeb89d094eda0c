#include "observation/unexcited.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "depthservo/depth/Excitation.h"

namespace depthservo {
namespace {

struct Open {
  UnexcitedPeriod period;
  bool isOpen = false;
};

}  // namespace

std::vector<UnexcitedPeriod> unexcitedPeriods(const RunLog& log) {
  std::vector<UnexcitedPeriod> periods;
  std::map<int, Open> open;
  const auto close = [&](Open& o) {
    if (o.isOpen && o.period.end_s - o.period.begin_s >= kUnexcitedFor_s) {
      periods.push_back(o.period);
    }
    o.isOpen = false;
  };
  Excitation excitation;
  for (std::size_t k = 0; k < log.frames.size(); ++k) {
    const FrameRecord& frame = log.frames[k];
    if (k > 0) {
      excitation.add(Motion::fromTwist(frame.twist, frame.time_s - log.frames[k - 1].time_s));
    }
    for (const FeatureRecord& feature : frame.features) {
      Open& o = open[feature.id];
      const DepthEstimate& estimate = feature.estimate;
      if (estimate.status != DepthStatus::unexcited) {
        close(o);
        continue;
      }
      if (!o.isOpen) o = {{feature.id, frame.time_s, frame.time_s, ""}, true};
      if (o.period.end_s - o.period.begin_s < kUnexcitedFor_s) {
        o.period.because = describe(excitation.ofDepth(estimate.x, estimate.y), feature.id);
      }
      o.period.end_s = frame.time_s;
    }
  }
  for (auto& [id, o] : open) close(o);
  std::stable_sort(periods.begin(), periods.end(),
                   [](const auto& a, const auto& b) { return a.begin_s < b.begin_s; });
  return periods;
}

void addUnexcitedEvents(RunLog& log) {
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
