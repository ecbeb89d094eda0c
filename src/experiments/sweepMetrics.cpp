#include "experiments/sweepMetrics.h"

#include <algorithm>

namespace depthservo {
namespace {

double count(std::size_t number) { return static_cast<double>(number); }

/// When the last of the points was known to 5 %; kUnknown: not all were.
double timeTo5Percent(const Metrics& m) {
  double latest = m.points.empty() ? kUnknown : 0;
  for (const PointMetrics& point : m.points) {
    if (!(point.time_to_5pct_s >= 0)) return kUnknown;
    latest = std::max(latest, point.time_to_5pct_s);
  }
  return latest;
}

const std::vector<std::pair<std::string, SweepMetric>>& allMetrics() {
  static const std::vector<std::pair<std::string, SweepMetric>> all = {
      {"duration_s", [](const Metrics& m) { return m.duration_s; }},
      {"frames", [](const Metrics& m) { return count(m.frames); }},
      {"min_frame_rate", [](const Metrics& m) { return m.min_frame_rate; }},
      {"final_error_px", [](const Metrics& m) { return m.final_error_px; }},
      {"final_distance_m", [](const Metrics& m) { return m.final_distance_m; }},
      {"final_angle_rad", [](const Metrics& m) { return m.final_angle_rad; }},
      {"max_gap_s", [](const Metrics& m) { return m.max_gap_s; }},
      {"min_border_px", [](const Metrics& m) { return m.min_border_px; }},
      {"final_depth_error_max", [](const Metrics& m) { return m.final_depth_error_max; }},
      {"coverage_2sigma", [](const Metrics& m) { return m.coverage_2sigma; }},
      {"rejected_measurements", [](const Metrics& m) { return count(m.rejected_measurements); }},
      {"rejected_points", [](const Metrics& m) { return count(m.rejected_points); }},
      {"time_to_5pct_s", timeTo5Percent}};
  return all;
}

}  // namespace

const std::vector<std::string>& sweepMetricNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, metric] : allMetrics()) all.push_back(name);
    return all;
  }();
  return names;
}

std::optional<SweepMetric> sweepMetric(const std::string& name) {
  for (const auto& [known, metric] : allMetrics()) {
    if (known == name) return metric;
  }
  return std::nullopt;
}

const std::vector<std::string>& outcomeNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Outcome outcome :
         {Outcome::converged, Outcome::timeout, Outcome::stalled, Outcome::leftImage, Outcome::lost,
          Outcome::diverged, Outcome::collision}) {
      all.emplace_back(toString(outcome));
    }
    all.emplace_back(kRefused);
    return all;
  }();
  return names;
}

bool outcomeNamed(const std::string& name) {
  const auto& names = outcomeNames();
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace depthservo
