#include <fmt/core.h>

#include <memory>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/scenario/run.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

void recordScenario(const std::string& file, const std::vector<std::string>& overrides,
                    const std::string& folder) {
  const Scenario scenario = Scenario::load(scenarioFile(file), overrides);
  RunLog log;
  {
    RunProgress progress("record " + scenario.name, 0, scenario.duration);
    log = record(scenario, folder, &progress);
  }
  fmt::print(stderr, "{}: {} frames of a run that ended {}\n", folder, log.frames.size(),
             toString(log.outcome));
}

}  // namespace

void addRecord(CLI::App& app, int&) {
  CLI::App* command =
      app.add_subcommand("record", "Write a run as a sequence that replay can read");
  auto scenario = std::make_shared<std::string>();
  auto folder = std::make_shared<std::string>();
  auto overrides = std::make_shared<std::vector<std::string>>();
  command->add_option("SCENARIO", *scenario, kScenarioHelp)->required();
  command->add_option("SEQUENCE", *folder, "Folder to write; must not exist")->required();
  command->add_option("--set", *overrides, "Override a key of the scenario; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->callback([=] { recordScenario(*scenario, *overrides, *folder); });
}

}  // namespace depthservo
