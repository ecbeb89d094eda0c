#include "depthservo/experiments/Sweep.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <set>

#include "depthservo/text/InputError.h"
#include "experiments/Claim.h"
#include "experiments/Draws.h"
#include "experiments/sweepAxes.h"
#include "experiments/sweepKeys.h"
#include "experiments/sweepMetrics.h"
#include "experiments/sweepStarts.h"
#include "scenario/FieldReader.h"
#include "text/StrictYaml.h"

namespace depthservo {
namespace {

constexpr double kMostRuns = 1e8;
constexpr const char* kRepeat = "repeat";

SweepOptions readOptions(const std::string& text, const std::string& file) {
  SweepOptions options;
  const detail::YamlValue root = detail::parseYaml(text, file);
  detail::FieldReader(root, file, "", [&](detail::Fields& f) { describe(f, options); });
  return options;
}

bool setsSeed(const std::string& setting) { return setting.rfind("seed=", 0) == 0; }
std::string seedSetting(unsigned seed) { return fmt::format("seed={}", seed); }

}  // namespace

struct Sweep::Parts {
  explicit Parts(Source s)
      : source(std::move(s)),
        options(readOptions(source.text, source.file)),
        base(source.scenarioText, source.scenarioFile) {}

  [[noreturn]] void refuse(const std::string& key, const std::string& why) const {
    throw InputError({source.file, 0, key}, why);
  }
  void expandAxes();
  void nameColumns();
  void checkNames() const;
  void checkColumn(const std::string& key, const std::string& column) const;
  void checkValues() const;
  void identify();
  std::vector<std::size_t> places(std::size_t index) const;
  Row rowOf(const std::vector<std::size_t>& places, std::size_t repetition) const;
  unsigned seedOf(const std::vector<std::size_t>& places, std::size_t repetition) const;
  Scenario scenario(const Row& row, const std::vector<std::string>& overrides) const;
  Scenario scenarioOf(std::vector<std::string> settings, std::optional<unsigned> seed) const;

  Source source;
  SweepOptions options;
  ScenarioText base;
  std::vector<SweptAxis> axes;
  std::vector<std::string> columns;
  std::size_t combinations = 1;
  std::string identity;

  /// The last scenario that was read: neighbours often differ in seed and start only.
  struct Read {
    std::vector<std::string> settings;
    Scenario scenario;
  };
  mutable std::mutex readMutex;
  mutable std::shared_ptr<const Read> lastRead;
};

Sweep Sweep::load(const std::string& file,
                  const std::function<std::string(const std::string&)>& resolve) {
  Source source;
  source.file = file;
  source.text = detail::readYamlText(file);
  const std::string named = readOptions(source.text, file).scenario;
  const std::filesystem::path beside = std::filesystem::path(file).parent_path() / named;
  std::error_code ignored;
  const bool isBeside = std::filesystem::is_regular_file(beside, ignored);
  source.scenarioFile = isBeside ? beside.string() : resolve(named);
  source.scenarioText = detail::readYamlText(source.scenarioFile);
  return Sweep(std::move(source));
}

Sweep::Sweep(Source source) {
  auto parts = std::make_unique<Parts>(std::move(source));
  parts->expandAxes();
  parts->nameColumns();
  parts->checkNames();
  parts->checkValues();
  parts->identify();
  parts_ = std::move(parts);
}

Sweep::~Sweep() = default;
Sweep::Sweep(Sweep&&) noexcept = default;

const SweepOptions& Sweep::options() const { return parts_->options; }
const Sweep::Source& Sweep::source() const { return parts_->source; }
const std::vector<std::string>& Sweep::columns() const { return parts_->columns; }
const std::string& Sweep::identity() const { return parts_->identity; }
std::size_t Sweep::size() const {
  return parts_->combinations * static_cast<std::size_t>(parts_->options.repeat);
}

Sweep::Row Sweep::row(std::size_t index) const {
  const auto repeat = static_cast<std::size_t>(parts_->options.repeat);
  return parts_->rowOf(parts_->places(index / repeat), index % repeat);
}

Scenario Sweep::scenario(const Row& row, const std::vector<std::string>& overrides) const {
  return parts_->scenario(row, overrides);
}

/// A cone is drawn where every run has the same target: before other axes change it.
void Sweep::Parts::expandAxes() {
  if (options.axes.empty()) refuse("axes", "a sweep varies at least one thing; add an axis");
  double runs = options.repeat;
  for (const SweepAxis& axis : options.axes) {
    const AxisContext context{source.file, options.seed, [&] {
                                return scenario({{}, options.set, options.seed}, {});
                              }};
    axes.push_back(sweptAxis(axis, context));
    runs *= static_cast<double>(axes.back().values.size());
    if (runs > kMostRuns) {
      refuse("axes", fmt::format("{:.3g} runs are more than {:.0e}; make a sweep of fewer", runs,
                                 kMostRuns));
    }
    combinations *= axes.back().values.size();
  }
}

void Sweep::Parts::nameColumns() {
  for (const SweptAxis& axis : axes) {
    columns.insert(columns.end(), axis.columns.begin(), axis.columns.end());
  }
  if (options.repeat > 1) columns.emplace_back(kRepeat);
}

void Sweep::Parts::checkColumn(const std::string& key, const std::string& column) const {
  if (std::find(columns.begin(), columns.end(), column) != columns.end()) return;
  refuse(key, detail::unknownWord(column, columns));
}

/// What the parts of the file say of each other.
void Sweep::Parts::checkNames() const {
  std::set<std::string> taken{"row", "seed", "outcome", "reason"};
  for (const std::string& metric : options.metrics) {
    if (!sweepMetric(metric)) refuse("metrics", detail::unknownWord(metric, sweepMetricNames()));
    if (!taken.insert(metric).second) refuse("metrics", metric + " appears twice");
  }
  for (const std::string& column : columns) {
    if (taken.insert(column).second) continue;
    refuse("axes", "the column " + column + " appears twice; name the axis otherwise");
  }
  for (const std::string& outcome : options.success) {
    if (!outcomeNamed(outcome)) refuse("success", detail::unknownWord(outcome, outcomeNames()));
  }
  std::vector<std::string> names;
  for (const SweptAxis& axis : axes) names.push_back(axis.columns.front());
  for (const std::string& axis : options.seededBy) {
    if (std::find(names.begin(), names.end(), axis) == names.end()) {
      refuse("seeded_by", detail::unknownWord(axis, names));
    }
  }
  for (const SweepMap& map : options.maps) {
    checkColumn("maps.x", map.x);
    checkColumn("maps.y", map.y);
    if (!map.by.empty()) checkColumn("maps.by", map.by);
  }
  for (const SweepCurve& curve : options.curves) {
    checkColumn("curves.x", curve.x);
    if (!curve.by.empty()) checkColumn("curves.by", curve.by);
  }
  for (const SweepClaim& claim : options.claims) {
    const std::string key = "claims." + claim.id;
    const bool needsMetric = claim.of != SweepFigure::share && claim.of != SweepFigure::count;
    const auto& metrics = options.metrics;
    if (needsMetric && std::find(metrics.begin(), metrics.end(), claim.metric) == metrics.end()) {
      refuse(key + ".metric", detail::unknownWord(claim.metric, metrics));
    }
    for (const std::string& condition : claim.where) {
      const std::size_t equals = condition.find('=');
      if (equals == std::string::npos) refuse(key + ".where", "expected column=value");
      checkColumn(key + ".where", condition.substr(0, equals));
    }
    Claim judged;
    judged.within = claim.within;
    const auto [fault, why] = judged.fault();
    if (!fault.empty()) refuse(key + "." + fault, why);
  }
}

/// Each value of each axis, beside the first ones of the others.
void Sweep::Parts::checkValues() const {
  std::vector<std::size_t> places(axes.size(), 0);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    for (places[a] = 0; places[a] < axes[a].values.size(); ++places[a]) {
      if (a > 0 && places[a] == 0) continue;
      try {
        scenario(rowOf(places, 0), {});
      } catch (const InputError& error) {
        const std::string prefix = "--set ";
        const std::string& key = error.key();
        const std::string what = key.rfind(prefix, 0) == 0 ? key.substr(prefix.size()) : key;
        throw InputError({source.file, 0, "axes." + axes[a].columns.front()},
                         fmt::format("{}: {}", what, error.message()));
      }
    }
    places[a] = 0;
  }
}

std::vector<std::size_t> Sweep::Parts::places(std::size_t index) const {
  std::vector<std::size_t> places(axes.size());
  for (std::size_t a = axes.size(); a-- > 0; index /= axes[a].values.size()) {
    places[a] = index % axes[a].values.size();
  }
  return places;
}

Sweep::Row Sweep::Parts::rowOf(const std::vector<std::size_t>& places,
                               std::size_t repetition) const {
  Row row;
  row.settings = options.set;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const SweptValue& value = axes[a].values[places[a]];
    row.cells.insert(row.cells.end(), value.cells.begin(), value.cells.end());
    row.settings.insert(row.settings.end(), value.settings.begin(), value.settings.end());
  }
  if (options.repeat > 1) row.cells.push_back(std::to_string(repetition));
  auto last = std::find_if(row.settings.rbegin(), row.settings.rend(), setsSeed);
  if (last == row.settings.rend()) {
    row.settings.push_back(seedSetting(seedOf(places, repetition)));
    last = row.settings.rbegin();
  }
  const auto seed = detail::toInteger(last->substr(last->find('=') + 1));
  row.seed = static_cast<unsigned>(seed.value_or(0));
  return row;
}

/// By the names and values of the coordinates: a value more on an axis leaves the other runs as
/// they are.
unsigned Sweep::Parts::seedOf(const std::vector<std::size_t>& places,
                              std::size_t repetition) const {
  std::string text = fmt::format("{}", options.seed);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const auto& by = options.seededBy;
    const std::string& name = axes[a].columns.front();
    if (!by.empty() && std::find(by.begin(), by.end(), name) == by.end()) continue;
    text += fmt::format("|{}={}", name, fmt::join(axes[a].values[places[a]].cells, ","));
  }
  text += fmt::format("|{}={}", kRepeat, repetition);
  return static_cast<unsigned>(Draws(text).bits() >> 32U);
}

Scenario Sweep::Parts::scenario(const Row& row, const std::vector<std::string>& overrides) const {
  std::vector<std::string> settings = row.settings;
  const std::optional<SweepStart> start = takeStart(settings, source.file);
  std::optional<unsigned> seed;
  const bool isSeedOverridden = std::any_of(overrides.begin(), overrides.end(), setsSeed);
  if (!isSeedOverridden && !settings.empty() && settings.back() == seedSetting(row.seed)) {
    seed = row.seed;
    settings.pop_back();
  }
  settings.insert(settings.end(), overrides.begin(), overrides.end());
  Scenario scenario = scenarioOf(std::move(settings), seed);
  if (start) scenario.robot.initial = poseAt(scenario, *start);
  return scenario;
}

/// \param seed none: as the settings have it
Scenario Sweep::Parts::scenarioOf(std::vector<std::string> settings,
                                  std::optional<unsigned> seed) const {
  std::shared_ptr<const Read> last;
  {
    const std::lock_guard lock(readMutex);
    last = lastRead;
  }
  if (!last || last->settings != settings) {
    Scenario read = base.with(settings);
    last = std::make_shared<const Read>(Read{std::move(settings), std::move(read)});
    const std::lock_guard lock(readMutex);
    lastRead = last;
  }
  Scenario scenario = last->scenario;
  if (seed) scenario.seed = *seed;
  return scenario;
}

void Sweep::Parts::identify() {
  const std::vector<std::size_t> first(axes.size(), 0);
  identity =
      fmt::format("depthservo {}\nscenario {}\nset {}\nrepeat {} seed {} by {}\nmetrics {}\n",
                  DEPTHSERVO_VERSION, scenario(rowOf(first, 0), {}).toJson(),
                  fmt::join(options.set, " "), options.repeat, options.seed,
                  fmt::join(options.seededBy, ","), fmt::join(options.metrics, ","));
  for (const SweptAxis& axis : axes) {
    identity += fmt::format("axis {}\n", fmt::join(axis.columns, ","));
    for (const SweptValue& value : axis.values) {
      identity +=
          fmt::format("  {}: {}\n", fmt::join(value.cells, ","), fmt::join(value.settings, " "));
    }
  }
}

}  // namespace depthservo
