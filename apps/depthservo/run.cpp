#include "depthservo/scenario/run.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <memory>

#include "ProgressBar.h"
#include "Recording.h"
#include "TagLines.h"
#include "View.h"
#include "commands.h"
#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/experiments/expectation.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/text/InputError.h"
#include "findings.h"
#include "observation.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

struct RunArguments {
  std::string scenario, sweep;
  std::size_t row = 0;
  std::vector<std::string> overrides;
  std::string out;
  RecordingFiles files;
  bool json = false, view = false;
};

/// Progress for everybody, a window for whoever asked for one.
class Audience : public RunProgress {
 public:
  Audience(const Scenario& scenario, std::unique_ptr<View> view)

      : RunProgress(scenario.name, 0, scenario.duration), view_(std::move(view)) {}

  bool onFrame(const RunFrame& frame) override {
    RunProgress::onFrame(frame);
    if (view_) view_->show(frame.exposure.image, frame.record, frame.log);
    return true;
  }

 private:
  std::unique_ptr<View> view_;
};

/// \throw InputError there is no display, or the scenario has no images
std::unique_ptr<View> viewOf(const Scenario& scenario) {
  if (scenario.sensing.source != SensingSource::image) {
    throw InputError({"--view", 0, ""}, "this scenario has no images (sensing.source: geometry)");
  }
  return View::open(ViewOptions{scenario.camera.width, scenario.camera.height,
                                scenario.camera.rate.front(), scenario.name, "--view"});
}

std::string verdict(const RunLog& log, const Metrics& metrics) {
  std::string text = fmt::format("{}: {} after {:.2f} s: {}", log.name, toString(log.outcome),
                                 metrics.duration_s, log.reason);
  if (std::isfinite(metrics.final_depth_error_max)) {
    text += fmt::format("; worst depth error {}", inPercent(metrics.final_depth_error_max));
  }
  return text;
}

/// Says what was not as expected.
int exitCodeOf(const Scenario& scenario, const RunLog& log, const Metrics& metrics) {
  if (scenario.expect) {
    const std::vector<std::string> differences = unmet(scenario, log, metrics);
    for (const std::string& difference : differences) fmt::print(stderr, "{}\n", difference);
    return differences.empty() ? kMet : kNotMet;
  }
  const bool isUsual = log.outcome == Outcome::converged || log.outcome == Outcome::timeout;
  return isUsual ? kMet : kOtherOutcome;
}

/// That of a row of a sweep; says what the sweep has of it.
Scenario scenarioOfRow(const RunArguments& arguments) {
  const SweepFolder folder = SweepFolder::open(arguments.sweep);
  const Sweep& sweep = folder.sweep();
  if (arguments.row >= sweep.size()) {
    throw InputError({"--row", 0, ""},
                     fmt::format("{} has rows 0 to {}", arguments.sweep, sweep.size() - 1));
  }
  const Sweep::Row row = sweep.row(arguments.row);
  fmt::print(stderr, "row {} of {}: {}\n", arguments.row, sweep.options().name,
             fmt::join(row.settings, " "));
  for (const SweepResult& result : folder.results()) {
    if (result.row != arguments.row) continue;
    fmt::print(stderr, "in the sweep: {}: {}\n", result.outcome, result.reason);
  }
  return sweep.scenario(row, arguments.overrides);
}

Scenario scenarioOf(const RunArguments& arguments) {
  if (arguments.scenario.empty() == arguments.sweep.empty()) {
    throw InputError({"run", 0, ""}, "needs a SCENARIO, or --of SWEEP_DIR with --row N");
  }
  if (!arguments.sweep.empty()) return scenarioOfRow(arguments);
  return Scenario::load(scenarioFile(arguments.scenario), arguments.overrides);
}

int runScenario(const RunArguments& arguments) {
  const Scenario scenario = scenarioOf(arguments);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);
  auto view = arguments.view ? viewOf(scenario) : nullptr;

  RunLog log;
  {
    Audience audience(scenario, std::move(view));
    Recording recorder(arguments.files, &audience);
    log = run(scenario, &recorder);
    recorder.finish(log);
  }
  if (!arguments.out.empty()) writeRunFolder(log, arguments.out);
  const Metrics metrics = computeMetrics(log);
  fmt::print(stderr, "{}\n", verdict(log, metrics));
  if (const std::string left = wayLeft(log, metrics); !left.empty()) {
    fmt::print(stderr, "the camera is {}\n", left);
  }
  printFindings(log);
  printTags(log);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(log, metrics));
  return exitCodeOf(scenario, log, metrics);
}

}  // namespace

void addRun(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("run", "Servo a simulated robot to its goal");
  auto arguments = std::make_shared<RunArguments>();
  command->add_option("SCENARIO", arguments->scenario, kScenarioHelp);
  auto* row = command->add_option("--row", arguments->row, "Number of the run in the sweep, from 0")
                  ->type_name("N");
  auto* of = command->add_option("--of", arguments->sweep, "Repeat a run of this sweep")
                 ->type_name("SWEEP_DIR")
                 ->needs(row);
  row->needs(of);
  command
      ->add_option("--set", arguments->overrides,
                   "Override a key of the scenario, e.g. depth.initial=8; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command
      ->add_option("--out", arguments->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  addRecordingOptions(*command, arguments->files);
  command->add_flag("--json", arguments->json, "Print the result as one JSON object on stdout");
  command->add_flag("--view", arguments->view, "Show the image with overlay while it runs");
  command->callback([arguments, &exitCode] { exitCode = runScenario(*arguments); });
}

}  // namespace depthservo
