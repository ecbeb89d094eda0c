#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "depthservo/experiments/expectation.h"
#include "depthservo/scenario/run.h"
#include "depthservo/text/InputError.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct RegressArguments {
  std::vector<std::string> scenarios;
  bool json = false;
};

/// The files of a folder, by name; a file, or a shipped scenario, as it is.
std::vector<std::string> filesOf(const std::string& name) {
  const std::string place = pathOrShipped(name);
  std::error_code error;
  if (!fs::is_directory(place, error)) return {scenarioFile(name)};
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(place)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  if (files.empty()) throw InputError({name, 0, ""}, "has no scenarios (*.yaml)");
  std::sort(files.begin(), files.end());
  return files;
}

Scenario scenarioIn(const std::string& file) {
  Scenario scenario = Scenario::load(file);
  if (scenario.expect) return scenario;
  throw InputError({file, 0, "expect"}, "is missing; say what the run must come to");
}

/// One row of the table.
Json resultOf(const Scenario& scenario) {
  const RunLog log = run(scenario);
  const Metrics metrics = computeMetrics(log);
  const std::vector<std::string> differences = unmet(scenario, log, metrics);
  Json row{{"scenario", scenario.file},
           {"pass", differences.empty()},
           {"outcome", toString(log.outcome)}};
  row["coverage_2sigma"] = metrics.coverage_2sigma;  // null where it is not known
  row["valid"] =
      std::count_if(metrics.points.begin(), metrics.points.end(),
                    [](const PointMetrics& point) { return point.status == DepthStatus::valid; });
  row["points"] = metrics.points.size();
  const bool isFault = log.diagnosis && log.diagnosis->isFault();
  row["diagnosis"] = isFault ? ConsistencyMonitor::toString(log.diagnosis->latest.cause) : "none";
  row["unmet"] = differences;
  return row;
}

void print(const Json& row) {
  const Json& coverage = row["coverage_2sigma"];
  const bool isKnown = coverage.is_number() && std::isfinite(coverage.get<double>());
  fmt::print("{:4} {:<36} {:<10} {:>8} {:>3} of {:<2} {:<14} {}\n",
             row["pass"].get<bool>() ? "ok" : "FAIL",
             fs::path(row["scenario"].get<std::string>()).stem().string(),
             row["outcome"].get<std::string>(),
             isKnown ? fmt::format("{:.3f}", coverage.get<double>()) : "-", row["valid"].get<int>(),
             row["points"].get<int>(), row["diagnosis"].get<std::string>(),
             fmt::join(row["unmet"].get<std::vector<std::string>>(), "; "));
}

int regress(const RegressArguments& arguments) {
  std::vector<Scenario> scenarios;  // all of them are read before anything is run
  for (const std::string& name : arguments.scenarios) {
    for (const std::string& file : filesOf(name)) scenarios.push_back(scenarioIn(file));
  }
  if (!arguments.json) {
    fmt::print("{:4} {:<36} {:<10} {:>8} {:<9} {:<14}\n", "", "scenario", "outcome", "coverage",
               "valid", "diagnosis");
  }
  Json rows = Json::array();
  std::size_t met = 0;
  for (const Scenario& scenario : scenarios) {
    rows.push_back(resultOf(scenario));
    met += rows.back()["pass"].get<bool>() ? 1 : 0;
    if (!arguments.json) print(rows.back());
  }
  if (arguments.json) fmt::print("{}\n", rows.dump(2, ' ', false, Json::error_handler_t::replace));
  fmt::print(stderr, "{} of {} scenarios are as expected\n", met, scenarios.size());
  return met == scenarios.size() ? kMet : kNotMet;
}

}  // namespace

void addRegress(CLI::App& app, int& exitCode) {
  CLI::App* command =
      app.add_subcommand("regress", "Run scenarios and say which do not come to what they expect");
  auto a = std::make_shared<RegressArguments>();
  command
      ->add_option("SCENARIO", a->scenarios,
                   "Files with `expect`, folders of them, or names of shipped ones")
      ->required();
  command->add_flag("--json", a->json, "Print one JSON array on stdout");
  command->callback([a, &exitCode] { exitCode = regress(*a); });
}

}  // namespace depthservo
