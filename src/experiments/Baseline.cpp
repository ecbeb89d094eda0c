#include "depthservo/experiments/Baseline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "depthservo/report/Metrics.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/NewFolder.h"

namespace depthservo {
namespace {

/// Parts of the sequence after which depths are compared.
constexpr int kCheckpoints_percent[] = {10, 25, 50, 75, 100};

bool isSame(double a, double b, double tolerance) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  return std::abs(a - b) <= tolerance * std::max(std::abs(a), std::abs(b));
}

}  // namespace

Baseline Baseline::of(const RunLog& log) {
  Baseline baseline;
  baseline.name_ = log.name;
  auto& figures = baseline.figures_;
  const Metrics metrics = computeMetrics(log);
  figures.emplace_back("frames", metrics.frames);
  for (const PointMetrics& point : metrics.points) {
    figures.emplace_back(fmt::format("point {}, measured frames", point.id), point.measured_frames);
  }
  for (const int percent : kCheckpoints_percent) {
    const std::size_t count = log.frames.size() * static_cast<std::size_t>(percent) / 100;
    if (count == 0) continue;
    for (const FeatureRecord& feature : log.frames[count - 1].features) {
      const DepthEstimate& e = feature.estimate;
      figures.emplace_back(fmt::format("point {}, Z at {} %", feature.id, percent), e.Z());
      figures.emplace_back(fmt::format("point {}, sigma_Z at {} %", feature.id, percent),
                           e.sigma_Z());
    }
  }
  return baseline;
}

Baseline Baseline::load(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) {
    throw InputError({file.string(), 0, ""}, "no such baseline; make it with --update");
  }
  Baseline baseline;
  try {
    const auto json = nlohmann::ordered_json::parse(in);
    baseline.name_ = json.at("name").get<std::string>();
    baseline.tolerance_ = json.at("tolerance").get<double>();
    for (const auto& [figure, value] : json.at("figures").items()) {
      baseline.figures_.emplace_back(figure, value.get<double>());
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file.string(), 0, ""},
                     fmt::format("not a baseline ({}); make it anew with --update", error.what()));
  }
  if (!(baseline.tolerance_ >= 0)) {
    throw InputError({file.string(), 0, "tolerance"}, "must be 0 or more");
  }
  return baseline;
}

void Baseline::save(const std::filesystem::path& file) const {
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
  for (const auto& [figure, value] : figures_) figures[figure] = value;
  const nlohmann::ordered_json json{
      {"name", name_}, {"tolerance", tolerance_}, {"figures", figures}};
  replaceFile(file, json.dump(2) + "\n");
}

std::vector<Baseline::Difference> Baseline::differences(const Baseline& now) const {
  std::map<std::string, double> others(now.figures_.begin(), now.figures_.end());
  std::vector<Difference> moved;
  for (const auto& [figure, accepted] : figures_) {
    const auto other = others.find(figure);
    const double value = other == others.end() ? kUnknown : other->second;
    if (!isSame(accepted, value, tolerance_)) moved.push_back({figure, accepted, value});
    if (other != others.end()) others.erase(other);
  }
  for (const auto& [figure, value] : now.figures_) {
    if (others.count(figure)) moved.push_back({figure, kUnknown, value});
  }
  return moved;
}

}  // namespace depthservo
