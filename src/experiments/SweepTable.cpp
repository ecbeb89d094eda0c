#include "experiments/SweepTable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "experiments/sweepMetrics.h"
#include "scenario/keys.h"
#include "text/KeyTree.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

constexpr std::size_t kMostPlaces = 16;  // more numbers than that are put into bins
constexpr std::size_t kBins = 10;
constexpr std::size_t kMostWords = 12;

/// What no run should end with comes first.
constexpr const char* kBySeverity[] = {"collision", "diverged", "lost",      "left-image",
                                       "stalled",   "timeout",  "converged", kRefused};

std::size_t severityOf(const std::string& outcome) {
  const auto* found = std::find(std::begin(kBySeverity), std::end(kBySeverity), outcome);
  return static_cast<std::size_t>(found - std::begin(kBySeverity));
}

std::string unitOf(const std::vector<detail::KeyNode>& keys, const std::string& path) {
  const std::string first = path.substr(0, path.find('.'));
  for (const detail::KeyNode& key : keys) {
    if (key.name != first) continue;
    return first == path ? key.unit : unitOf(key.below, path.substr(first.size() + 1));
  }
  return "";
}

/// The key that a column has the values of; empty: several.
std::string keyOf(const SweepOptions& options, const std::string& column) {
  for (const SweepAxis& axis : options.axes) {
    if (axis.name == column) return axis.key;
    if (axis.cone && column.rfind(axis.name + ".", 0) == 0) {
      return "start" + column.substr(axis.name.size());
    }
  }
  return "";
}

std::string titleOf(const SweepOptions& options, const std::string& column) {
  const std::string key = keyOf(options, column);
  std::string unit;
  if (key.rfind("start.", 0) == 0) {
    unit = key == "start.distance" ? "m" : "rad";
  } else if (!key.empty()) {
    Scenario scenario;
    unit = unitOf(detail::allKeys([&](detail::Fields& f) { describe(f, scenario); }), key);
  }
  return unit.empty() ? column : fmt::format("{} [{}]", column, unit);
}

bool isLog(const SweepOptions& options, const std::string& column) {
  return std::any_of(options.axes.begin(), options.axes.end(), [&](const SweepAxis& axis) {
    return axis.name == column && axis.isLog;
  });
}

/// Puts numbers into equal bins.
void bin(SweepScale& scale, const std::map<double, std::string>& byNumber) {
  const auto measure = [&](double x) { return scale.isLog ? std::log(x) : x; };
  const auto value = [&](double x) { return scale.isLog ? std::exp(x) : x; };
  const double low = measure(byNumber.begin()->first), high = measure(byNumber.rbegin()->first);
  const double width = (high - low) / kBins;
  scale.labels.clear();
  scale.numbers.clear();
  for (std::size_t i = 0; i <= kBins; ++i) {
    scale.edges.push_back(value(low + width * static_cast<double>(i)));
  }
  for (std::size_t i = 0; i < kBins; ++i) {
    scale.numbers.push_back(value(low + width * (static_cast<double>(i) + 0.5)));
    scale.labels.push_back(fmt::format("{:.2g}", scale.numbers.back()));
  }
  for (const auto& [number, cell] : byNumber) {
    const double place = std::floor((measure(number) - low) / width);
    scale.places[cell] = static_cast<std::size_t>(std::clamp(place, 0., kBins - 1.));
  }
}

}  // namespace

std::pair<double, double> Successes::interval() const {
  if (runs == 0) return {0, 1};
  constexpr double z = 1.959964;
  const auto n = static_cast<double>(runs);
  const double p = share(), scale = 1 / (1 + z * z / n);
  const double middle = scale * (p + z * z / (2 * n));
  const double half = scale * z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {std::max(0., middle - half), std::min(1., middle + half)};
}

SweepTable::SweepTable(const Sweep& sweep, std::vector<SweepResult> results)
    : sweep_(sweep), results_(std::move(results)) {
  rows_.reserve(results_.size());
  for (const SweepResult& result : results_) rows_.push_back(sweep.row(result.row));
}

std::size_t SweepTable::column(const std::string& name) const {
  const auto& all = sweep_.columns();
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), name) - all.begin());
}

SweepScale SweepTable::scale(const std::string& name) const {
  SweepScale scale;
  scale.title = titleOf(sweep_.options(), name);
  scale.isLog = isLog(sweep_.options(), name);
  std::map<double, std::string> byNumber;
  const std::size_t c = column(name);
  bool areNumbers = true;
  for (const Sweep::Row& row : rows_) {
    const std::string& cell = row.cells[c];
    if (!scale.places.emplace(cell, scale.labels.size()).second) continue;
    scale.labels.push_back(cell);
    const auto number = detail::toNumber(cell);
    areNumbers = areNumbers && number;
    if (number) byNumber[*number] = cell;
  }
  if (!areNumbers || byNumber.empty()) return scale;
  if (byNumber.size() > kMostPlaces) {
    bin(scale, byNumber);
    return scale;
  }
  scale.labels.clear();
  for (const auto& [number, cell] : byNumber) {
    scale.places[cell] = scale.labels.size();
    scale.labels.push_back(fmt::format("{:.3g}", number));
    scale.numbers.push_back(number);
  }
  return scale;
}

double SweepTable::metric(std::size_t result, const std::string& name) const {
  const auto& metrics = sweep_.options().metrics;
  const auto found = std::find(metrics.begin(), metrics.end(), name);
  if (found == metrics.end()) return kUnknown;
  return results_[result].metrics[static_cast<std::size_t>(found - metrics.begin())];
}

bool SweepTable::isSuccess(const std::string& outcome) const {
  const auto& success = sweep_.options().success;
  return std::find(success.begin(), success.end(), outcome) != success.end();
}

std::map<std::string, std::size_t> SweepTable::outcomes() const {
  std::map<std::string, std::size_t> counts;
  for (const SweepResult& result : results_) ++counts[result.outcome];
  return counts;
}

Successes SweepTable::all() const {
  Successes all{0, results_.size()};
  for (const SweepResult& result : results_) all.successes += isSuccess(result.outcome) ? 1 : 0;
  return all;
}

/// With more than one value; of words not too many.
std::vector<std::string> SweepTable::columnsThat(bool areOfNumbers) const {
  std::vector<std::string> names;
  for (const SweepAxis& axis : sweep_.options().axes) {
    std::vector<std::string> candidates{axis.name};
    if (axis.cone) candidates = {axis.name + ".distance", axis.name + ".bearing"};
    for (const std::string& name : candidates) {
      const SweepScale s = scale(name);
      const bool isShown = s.size() > 1 && (areOfNumbers || s.size() <= kMostWords);
      if (isShown && s.isOfNumbers() == areOfNumbers) names.push_back(name);
    }
  }
  return names;
}

std::vector<SweepMap> SweepTable::maps() const {
  if (!sweep_.options().maps.empty()) return sweep_.options().maps;
  const std::vector<std::string> numbers = columnsThat(true), words = columnsThat(false);
  SweepMap map;
  if (numbers.size() > 1) {
    map = {numbers[0], numbers[1], words.empty() ? "" : words[0]};
  } else if (numbers.size() == 1 && !words.empty()) {
    map = {numbers[0], words[0], words.size() > 1 ? words[1] : ""};
  } else if (words.size() > 1) {
    map = {words[1], words[0], words.size() > 2 ? words[2] : ""};
  } else {
    return {};
  }
  return {map};
}

std::vector<SweepCurve> SweepTable::curves() const {
  if (!sweep_.options().curves.empty()) return sweep_.options().curves;
  const std::vector<std::string> words = columnsThat(false);
  std::vector<SweepCurve> all;
  for (const std::string& x : columnsThat(true)) {
    all.push_back({x, words.empty() ? "" : words.front()});
  }
  return all;
}

std::vector<std::size_t> SweepTable::worst(std::size_t most) const {
  std::map<std::size_t, std::vector<std::size_t>> byKind;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    const std::string& outcome = results_[i].outcome;
    if (outcome == kRefused) continue;
    byKind[isSuccess(outcome) ? std::size(kBySeverity) : severityOf(outcome)].push_back(i);
  }
  const auto badness = [&](std::size_t i) {
    const bool isGood = isSuccess(results_[i].outcome);
    const double value = metric(i, isGood ? "final_depth_error_max" : "final_error_px");
    return std::isfinite(value) ? value : -std::numeric_limits<double>::infinity();
  };
  std::size_t longest = 0;
  for (auto& [kind, all] : byKind) {
    std::stable_sort(all.begin(), all.end(),
                     [&](std::size_t a, std::size_t b) { return badness(a) > badness(b); });
    if (kind < std::size(kBySeverity)) longest = std::max(longest, all.size());
  }
  std::vector<std::size_t> chosen;
  for (std::size_t place = 0; place < std::max<std::size_t>(1, longest); ++place) {
    for (const auto& [kind, all] : byKind) {
      const bool isGood = kind == std::size(kBySeverity);
      if (isGood && place > 0) continue;
      if (place < all.size() && chosen.size() < most) chosen.push_back(all[place]);
    }
  }
  return chosen;
}

}  // namespace depthservo
