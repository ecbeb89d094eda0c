#include "depthservo/experiments/Compare.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/report/RunFolder.h"
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

/// One line: a name, a figure at each time, and what follows.
void printLine(const Comparison& comparison, const ComparedEstimator& one,
               const std::vector<double>& values, const std::string& rest) {
  fmt::print("{:<12}", one.name);
  for (const std::size_t k : comparison.shown) fmt::print("{:>10}", percent(values[k], "-"));
  fmt::print("{}\n", rest);
}

void printHeader(const Comparison& comparison, const std::string& what, const std::string& rest) {
  fmt::print("{}\n{:<12}", what, "");
  for (const std::size_t k : comparison.shown) {
    fmt::print("{:>10}", fmt::format("{:.4g} s", comparison.time_s[k]));
  }
  fmt::print("{}\n", rest);
}

std::string images(double count) {
  return std::isfinite(count) ? fmt::format("{:.0f}", count) : "never";
}

void printTable(const Comparison& comparison) {
  if (comparison.hasTruth) {
    printHeader(comparison, "relative error of Z, rms over the points",
                fmt::format("{:>14}{:>10}{:>8}", "images to 5 %", "2 sigma", "NEES"));
    for (const ComparedEstimator& one : comparison.estimators) {
      const std::string nees =
          std::isfinite(one.mean_nees) ? fmt::format("{:.3g}", one.mean_nees) : "-";
      printLine(comparison, one, one.error,
                fmt::format("{:>14}{:>10}{:>8}", images(one.frames_to_5pct),
                            percent(one.coverage_2sigma, "-"), nees));
    }
    for (const ComparedEstimator& one : comparison.limits) {
      printLine(comparison, one, one.error, fmt::format("{:>14}", images(one.frames_to_5pct)));
    }
    fmt::print("\n");
  }
  printHeader(comparison, "sigma of Z claimed, relative", "");
  for (const auto& one : comparison.estimators) printLine(comparison, one, one.sigma, "");
  if (comparison.hasTruth) return;
  printHeader(comparison, "\ndifference of Z from " + comparison.reference + ", relative", "");
  for (const auto& one : comparison.estimators) printLine(comparison, one, one.difference, "");
}

void tellCost(const Comparison& comparison) {
  const ComparedEstimator& reference = costReference(comparison);
  fmt::print(stderr, "cost per image of {} points:", comparison.points);
  for (const ComparedEstimator& one : comparison.estimators) {
    fmt::print(stderr, " {} {:.3g} us ({:.2g} x {})", one.name, 1e6 * one.update_s,
               one.update_s / reference.update_s, reference.name);
  }
  fmt::print(stderr, "\n");
}

int compareAll(CompareArguments arguments) {
  for (const std::string& name : arguments.estimators) {
    arguments.options.estimators.push_back(estimatorNamed(name, {"--estimators", 0, ""}));
  }
  arguments.data = scenarioFile(arguments.data);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);
  const Comparison comparison = std::filesystem::is_directory(arguments.data)
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
                   "Scenario (YAML file or shipped name) or sequence (folder), see doc/formats.md")
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
