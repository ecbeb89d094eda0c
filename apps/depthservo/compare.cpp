#include "depthservo/experiments/Compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/text/NewFolder.h"
#include "observation.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

struct CompareArguments {
  std::string data, out;
  std::vector<std::string> estimators, overrides;
  SequenceArguments sequence;
  std::vector<const CLI::Option*> sequenceOptions;
  CompareOptions options;
  bool json = false;
};

Comparison compareScenario(const CompareArguments& arguments) {
  for (const CLI::Option* option : arguments.sequenceOptions) {
    if (option->count() == 0) continue;
    refuseOption(option->get_name(),
                 "is for sequences; in a scenario use --set, e.g. depth.initial=2");
  }
  const Scenario scenario = Scenario::load(arguments.data, arguments.overrides);
  RunProgress progress(scenario.name, 0, scenario.duration);
  return compare(scenario, arguments.options, &progress);
}

Comparison compareSequence(const CompareArguments& arguments) {
  if (!arguments.overrides.empty()) {
    refuseOption("--set", "is for scenarios, not for recorded data");
  }
  const Sequence sequence(arguments.data, arguments.sequence.source);
  for (const std::string& warning : sequence.warnings()) fmt::print(stderr, "note: {}\n", warning);
  const ObservationOptions options = optionsOf(arguments.sequence, sequence);
  RunProgress progress("compare " + sequence.name(), sequence.frames().front().time_s,
                       sequence.frames().back().time_s);
  return compare(sequence, options, arguments.options, &progress);
}

using Cells = std::vector<std::string>;

/// Rows of cells in columns that never touch: the first to the left, the others to the right.
void printColumns(const std::vector<Cells>& rows) {
  std::vector<std::size_t> widths;
  for (const Cells& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Cells& row : rows) {
    std::string line = fmt::format("{:<{}}", row.front(), widths.front());
    for (std::size_t i = 1; i < row.size(); ++i) line += fmt::format("  {:>{}}", row[i], widths[i]);
    fmt::print("{}\n", line);
  }
}

Cells headOf(const Comparison& comparison) {
  Cells head{""};
  for (const std::size_t k : comparison.shown) {
    head.push_back(fmt::format("{:.4g} s", comparison.time_s[k]));
  }
  return head;
}

Cells rowOf(const Comparison& comparison, const ComparedEstimator& one, ShownValues values) {
  Cells row{one.name};
  for (const std::size_t k : comparison.shown) row.push_back(percent((one.*values)[k], "-"));
  return row;
}

std::string images(double count) {
  return std::isfinite(count) ? fmt::format("{:.0f}", count) : "never";
}

/// What is said of an estimator as a whole, beside the times.
std::string speedOf(const Comparison& comparison, const ComparedEstimator& one) {
  if (!comparison.pointsComeAndGo) return images(one.frames_to_5pct);
  return one.within_5pct.empty() ? "-" : percent(one.within_5pct.back(), "-");
}

void printErrors(const Comparison& comparison, const ShownStatistic& shown) {
  std::vector<Cells> rows{headOf(comparison)};
  rows.front().insert(
      rows.front().end(),
      {comparison.pointsComeAndGo ? "within 5 %" : "images to 5 %", "2 sigma", "NEES"});
  for (const ComparedEstimator& one : comparison.estimators) {
    rows.push_back(rowOf(comparison, one, shown.error));
    rows.back().insert(rows.back().end(),
                       {speedOf(comparison, one), percent(one.coverage_2sigma, "-"),
                        std::isfinite(one.mean_nees) ? fmt::format("{:.3g}", one.mean_nees) : "-"});
  }
  for (const ComparedEstimator& one : comparison.limits) {
    rows.push_back(rowOf(comparison, one, shown.error));
    rows.back().push_back(speedOf(comparison, one));
  }
  fmt::print("{}\n", shown.ofError);
  printColumns(rows);
}

void printValues(const Comparison& comparison, const std::string& heading, ShownValues values) {
  std::vector<Cells> rows{headOf(comparison)};
  for (const auto& one : comparison.estimators) rows.push_back(rowOf(comparison, one, values));
  fmt::print("{}\n", heading);
  printColumns(rows);
}

void printTable(const Comparison& comparison) {
  const ShownStatistic shown = shownStatistic(comparison);
  if (comparison.hasTruth) {
    printErrors(comparison, shown);
    fmt::print("\n");
  }
  printValues(comparison, shown.ofSigma, shown.sigma);
  if (comparison.hasTruth) return;
  fmt::print("\n");
  printValues(comparison, shown.ofDifference, shown.difference);
}

void tellCost(const Comparison& comparison) {
  const ComparedEstimator& reference = costReference(comparison);
  fmt::print(stderr, "cost per image of {} points:\n", comparison.points);
  for (const ComparedEstimator& one : comparison.estimators) {
    fmt::print(stderr, "  {:<10} {:>8.3g} us, {:.2g} x {}\n", one.name, 1e6 * one.update_s,
               one.update_s / reference.update_s, reference.name);
  }
}

int compareAll(CompareArguments arguments) {
  for (const std::string& name : arguments.estimators) {
    arguments.options.estimators.push_back(estimatorNamed(name, {"--estimators", 0, ""}));
  }
  arguments.data = scenarioFile(arguments.data);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);
  const bool isRecording = std::filesystem::is_directory(arguments.data) || isBag(arguments.data);
  const Comparison comparison = isRecording
                                    ? compareSequence(arguments)
                                    : compareScenario(arguments);
  if (!arguments.out.empty()) {
    if (!writeComparison(comparison, arguments.out)) {
      fmt::print(stderr, "note: the figure was not drawn; it needs gnuplot\n");
    }
  }
  fmt::print(stderr, "{}: {} images, {:.4g} s, {} points\n", comparison.name,
             comparison.time_s.size(), comparison.time_s.back(), comparison.points);
  if (!comparison.hasTruth) fmt::print(stderr, "the true depths are not known\n");
  tellCost(comparison);
  fmt::print(stderr, "{}\n", verdictOf(comparison));
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) {
    fmt::print("{}\n", toJson(comparison));
  } else {
    printTable(comparison);
  }
  return kMet;
}

}  // namespace

void addCompare(CLI::App& app, int& exitCode) {
  CLI::App* command =
      app.add_subcommand("compare", "Let all estimators observe the same measurements");
  auto a = std::make_shared<CompareArguments>();
  command
      ->add_option("DATA", a->data,
                   "Scenario (YAML file or shipped name) or sequence (folder or bag), see doc/formats.md")
      ->required();
  command
      ->add_option("--estimators", a->estimators,
                   "Some of constant,two-frame,nonlinear,window,filter,joint,pose; default: all "
                   "that these data allow")
      ->type_name("A,B,C")
      ->delimiter(',');
  command
      ->add_option("--times", a->options.times_s,
                   "Seconds after the first image at which figures are given")
      ->type_name("T,T")
      ->delimiter(',');
  command
      ->add_option("--set", a->overrides,
                   "Override a key of the scenario, e.g. depth.initial=8; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command
      ->add_option("--out", a->out,
                   "Write a folder with report.html and the curves; must not exist")
      ->type_name("DIR");
  const std::size_t own = command->get_options().size();
  addSequenceOptions(*command, a->sequence);
  for (std::size_t i = own; i < command->get_options().size(); ++i) {
    command->get_options()[i]->group("Options for sequences, as in replay");
    a->sequenceOptions.push_back(command->get_options()[i]);
  }
  command->callback([a, &exitCode] { exitCode = compareAll(*a); });
}

}  // namespace depthservo
