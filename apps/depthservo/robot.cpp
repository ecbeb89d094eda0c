#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>

#include "Interruption.h"
#include "commands.h"
#include "depthservo/rig/RobotServer.h"
#include "depthservo/robots/RobotModel.h"
#include "depthservo/scenario/Scenario.h"
#include "numbers.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

struct RobotArguments {
  std::string scenario;
  std::vector<std::string> overrides;
  RobotServerOptions server;
  bool json = false;
};

/// [greatest length in s, how often], so that several runs can be added.
nlohmann::ordered_json countsOf(const DurationHistogram& lengths) {
  auto counts = nlohmann::ordered_json::array();
  for (std::size_t bin = 0; bin < DurationHistogram::kBins; ++bin) {
    if (const auto n = lengths.inBin(bin)) counts.push_back({DurationHistogram::endOf(bin), n});
  }
  return counts;
}

nlohmann::ordered_json jsonOf(const std::string& name, const RobotServerReport& report) {
  std::vector<double> velocity(report.velocity.begin(), report.velocity.end());
  return {{"command", "robot"},
          {"name", name},
          {"reason", report.whyEnded},
          {"duration_s", report.duration_s},
          {"images", report.images},
          {"dropped", report.dropped},
          {"dropped_at_start", report.droppedAtStart},
          {"rows", report.rows},
          {"commands", report.commands},
          {"refused", report.refused},
          {"watchdog_stops", report.watchdogStops},
          {"latency_p50_s", report.latency.percentile(0.5)},
          {"latency_p999_s", report.latency.percentile(0.999)},
          {"latency_counts", countsOf(report.latency)},
          {"pose", {report.pose.x(), report.pose.y(), report.pose.z()}},
          {"velocity", velocity},
          {"goal_error_px", report.goalError_px}};
}

void tell(const std::string& name, const RobotServerReport& report) {
  fmt::print(stderr, "{}: {:.2f} s: {}\n", name, report.duration_s, report.whyEnded);
  fmt::print(stderr,
             "  {} images, {} dropped ({} before it moved); {} rows of odometry; {} commands, {} "
             "refused; stopped {} times "
             "for want of a command\n",
             report.images, report.dropped, report.droppedAtStart, report.rows, report.commands,
             report.refused, report.watchdogStops);
  if (report.latency.count() > 0) {
    fmt::print(stderr, "  image to command: p50 {:.1f} ms, p99.9 {:.1f} ms, of {} images\n",
               1e3 * report.latency.percentile(0.5), 1e3 * report.latency.percentile(0.999),
               report.latency.count());
  }
  fmt::print(stderr, "  at x {:.3f} m, y {:.3f} m, theta {:.3f} rad", report.pose.x(),
             report.pose.y(), report.pose.z());
  if (std::isfinite(report.goalError_px)) {
    fmt::print(stderr, "; {:.2f} px rms from the image at robot.goal", report.goalError_px);
  }
  fmt::print(stderr, "\n");
}

int serveRobot(const RobotArguments& arguments) {
  Scenario scenario = Scenario::load(scenarioFile(arguments.scenario), arguments.overrides);
  RowMeaning& rows = scenario.odometry.rows;
  if (rows == RowMeaning::hold) rows = RowMeaning::meanBefore;  // a robot tells what it has done
  if (scenario.sensing.source != SensingSource::image) {
    throw InputError({scenario.file, 0, "sensing.source"}, "a robot needs a camera: image");
  }
  std::signal(SIGPIPE, SIG_IGN);
  RobotServerOptions options = arguments.server;
  options.stop = &stopOnInterruption();
  RobotServer server(scenario, options, scenario.file);
  const RobotServerReport report = server.run();
  tell(scenario.name, report);
  if (arguments.json) fmt::print("{}\n", jsonOf(scenario.name, report).dump());
  return kMet;
}

}  // namespace

void addRobot(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand(
      "robot", "A scenario's robot as a process of its own: images and twists out, commands in");
  auto a = std::make_shared<RobotArguments>();
  command->add_option("SCENARIO", a->scenario, kScenarioHelp)->required();
  command
      ->add_option("--set", a->overrides,
                   "Override a key of the scenario, e.g. odometry.rate=100; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command
      ->add_option("--images", a->server.images,
                   "Pipe for images (PGM with '# timestamp'); made if it is not there")
      ->required()
      ->type_name("FIFO");
  command
      ->add_option("--twist", a->server.twist,
                   "Pipe for lines timestamp,vx,vy,vz,wx,wy,wz; made if it is not there")
      ->required()
      ->type_name("FIFO");
  command
      ->add_option("--command", a->server.command,
                   "Pipe of lines sequence,timestamp,ttl,image,v,w; made if it is not there")
      ->required()
      ->type_name("FIFO");
  command->add_flag("--lockstep", a->server.isLockstep,
                    "Wait for the command of every image, whatever the time; the same every time");
  command->add_option("--log", a->server.log, "CSV of what is true, by row of odometry; must not exist")
      ->type_name("FILE");
  command
      ->add_option("--wait", a->server.wait_s,
                   "For somebody who reads the images; in lockstep for a command [s]")
      ->type_name("S")
      ->check(within(0.0, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a, &exitCode] { exitCode = serveRobot(*a); });
}

}  // namespace depthservo
