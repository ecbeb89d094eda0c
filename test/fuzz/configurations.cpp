// YAML files: scenarios, sweeps, robots, errors, what is looked at.
#include <algorithm>
#include <cmath>

#include "Target.h"
#include "depthservo/experiments/Sweep.h"
#include "depthservo/scenario/RobotFile.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/text/InputError.h"

namespace depthservo::fuzz {
namespace {

const std::string kScenarioText =
    "name: small\nseed: 1\nduration: 1\n"
    "camera: {width: 64, height: 48, fx: 60, fy: 60, cx: 31.5, cy: 23.5, rate: 30}\n"
    "target: {type: dots, points: [[-0.1,-0.1,0],[0.1,-0.1,0],[0.1,0.1,0],[-0.1,0.1,0]], radius: 0.02,\n"
    "         pose: {xyz: [0,0,0.13], rpy: [-1.5707963267948966, 0, -1.5707963267948966]}}\n"
    "robot: {type: unicycle, initial: {x: -3.9, y: 0.3, theta: 0}, goal: {x: -1, y: 0, theta: 0}}\n"
    "depth: {initial: 2}\n";

const Target kScenario("scenario", [](const std::string& bytes) {
  const Scenario scenario = Scenario::load(written("scenario.yaml", bytes));
  require(scenario.duration > 0 && std::isfinite(scenario.duration), "a finite duration");
  require(!scenario.toJson().empty(), "a configuration");
});

/// A line each, as after `--set`.
const Target kOverrides("overrides", [](const std::string& bytes) {
  static const ScenarioText text(kScenarioText, "small.yaml");
  std::vector<std::string> overrides;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    overrides.push_back(bytes.substr(at, end - at));
    at = end + 1;
  }
  require(!text.with(overrides).toJson().empty(), "a configuration");
});

const Target kSweep("sweep", [](const std::string& bytes) {
  const Sweep sweep({"sweep.yaml", bytes, "small.yaml", kScenarioText});
  require(sweep.size() > 0, "a run");
  for (const std::size_t row : {std::size_t{0}, sweep.size() - 1}) {
    try {
      sweep.scenario(sweep.row(row));
    } catch (const InputError&) {  // values that do not go together
    }
  }
});

const Target kRobot("robot", [](const std::string& bytes) {
  readRobotFile(written("robot.yaml", bytes));
});

const Target kErrors("errors", [](const std::string& bytes) {
  readErrorProfile(written("errors.yaml", bytes));
});

const Target kSettings("target", [](const std::string& bytes) {
  observationOf(readTarget(written("target.yaml", bytes)).replay);
});

}  // namespace
}  // namespace depthservo::fuzz
