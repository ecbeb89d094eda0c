#include <fmt/core.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/experiments/Calibration.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/text/NewFolder.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct CalibrateArguments {
  std::string sequence, out, distance;
  SequenceArguments data;
  bool json = false;
};

std::pair<int, double> readDistance(const std::string& text) {
  int id = 0, end = 0;
  double metres = 0;
  if (std::sscanf(text.c_str(), "%d:%lf%n", &id, &metres, &end) != 2 ||
      end != static_cast<int>(text.size()) || !(metres > 0) || metres > 1e6) {
    refuseOption("--distance",
                 fmt::format("expected ID:METRES, metres in (0, 1e6], got '{}'", text));
  }
  return {id, metres};
}

void print(const Calibrated& c) {
  if (c.isShown) {
    fmt::print(stderr, "  {:<15} {:>10.4g} +- {:.2g} {} (1 sigma)\n", c.name, c.value, c.sigma,
               c.unit);
  } else {
    fmt::print(stderr, "  {:<15} not shown: {}\n", c.name, c.missing);
  }
}

nlohmann::ordered_json toJson(const std::vector<Calibrated>& all) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const Calibrated& c : all) {
    auto& item = json[c.name];
    item = {{"value", c.value}, {"sigma", nullptr}, {"unit", c.unit}, {"shown", c.isShown}};
    if (std::isfinite(c.sigma)) item["sigma"] = c.sigma;
    if (!c.isShown) item["missing"] = c.missing;
  }
  return json;
}

int calibrateSequence(const CalibrateArguments& a) {
  CalibrationOptions fit;
  if (!a.distance.empty()) fit.distance = readDistance(a.distance);
  if (!a.out.empty()) requireNewFile(a.out);
  const Sequence sequence(a.sequence, a.data.source);
  ObservationOptions options = optionsOf(a.data, sequence);
  if (options.tracker != TrackerKind::klt) fit.target = sequence.target();
  fit.prior = priorOf(options);
  fit.depth = DepthPrior{options.depth.initial};
  fit.range = options.depth.range();
  options.depth.estimator = EstimatorKind::constant;
  RunLog log;
  {
    RunProgress progress("calibrate " + sequence.name(), sequence.frames().front().time_s,
                         sequence.frames().back().time_s);
    log = replay(sequence, options, &progress);
  }
  const Calibration result = calibrate(log, fit);
  fmt::print(stderr, "{}: {} images, {} points; before them the profile {}\n", log.name,
             result.images, result.points, toString(options.depth.errors));
  for (const Calibrated& c : result.constants) print(c);
  for (const Calibrated& c : result.noises) print(c);
  if (a.json) {
    const nlohmann::ordered_json json = {{"images", result.images},
                                         {"points", result.points},
                                         {"nis", result.nis},
                                         {"constants", toJson(result.constants)},
                                         {"noises", toJson(result.noises)}};
    fmt::print("{}\n", json.dump(2));
  }
  if (!result.showsAnything()) {
    fmt::print(stderr, "nothing was learnt of the robot, nothing is written\n");
    return kOtherOutcome;
  }
  if (!a.out.empty()) {
    makeFile(a.out, profileYaml(result));
    fmt::print(stderr, "profile: {}; for replay and live: --errors {} --pixel-noise {:.3g}\n",
               a.out, a.out, result.pixelNoise_px);
  }
  return kMet;
}

}  // namespace

void addCalibrate(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand(
      "calibrate", "Learn the errors of a robot from a recording: a minute of driving");
  auto a = std::make_shared<CalibrateArguments>();
  command->add_option("SEQUENCE", a->sequence, "Folder or bag: see doc/formats.md")->required();
  addSequenceOptions(*command, a->data);
  command
      ->add_option("--distance", a->distance,
                   "Depth of a point at the end of the recording, measured: tells the scale")
      ->type_name("ID:METRES");
  command->add_option("--out", a->out, "Write the profile for --errors; must not exist")
      ->type_name("FILE");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a, &exitCode] { exitCode = calibrateSequence(*a); });
}

}  // namespace depthservo
