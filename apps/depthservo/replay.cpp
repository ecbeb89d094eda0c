#include "depthservo/servo/Replay.h"

#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/servo/Baseline.h"
#include "depthservo/servo/Metrics.h"
#include "depthservo/servo/RunFolder.h"
#include "observation.h"

namespace depthservo {
namespace {

struct ReplayArguments {
  std::string sequence, baseline, out, tracker = "auto", motion = "auto", observe = "depth";
  SequenceOptions source;
  ObservationArguments observation;
  bool update = false, json = false;
};

ReplayMotion motionNamed(const std::string& name) {
  if (name == "auto") return ReplayMotion::automatic;
  if (name == "twist") return ReplayMotion::twist;
  if (name == "groundtruth") return ReplayMotion::groundtruth;
  if (name == "target") return ReplayMotion::target;
  refuseOption("--motion",
               fmt::format("'{}' is not known; expected twist, groundtruth or target", name));
}

ReplayOptions optionsOf(const ReplayArguments& arguments, const Sequence& sequence) {
  ReplayOptions options = ReplayOptions::of(sequence);
  options.tracker = trackerNamed(arguments.tracker);
  options.motion = motionNamed(arguments.motion);
  if (arguments.observe == "focal") {
    refuseOption("--observe", "'focal' is not in this version; use depth");
  }
  if (arguments.observe != "depth") {
    refuseOption("--observe", fmt::format("'{}' is not known; expected depth", arguments.observe));
  }
  apply(arguments.observation, options);
  return options;
}

/// The exit code of comparing with a baseline, told on stderr.
int compare(const RunLog& log, const std::string& file, bool update) {
  Baseline now = Baseline::of(log);
  if (update) {
    if (std::filesystem::exists(file)) now.setTolerance(Baseline::load(file).tolerance());
    now.save(file);
    fmt::print(stderr, "baseline written: {}\n", file);
    return kMet;
  }
  const Baseline accepted = Baseline::load(file);
  const auto moved = accepted.differences(now);
  for (const Baseline::Difference& difference : moved) {
    fmt::print(stderr, "moved: {}: {} accepted, {} now\n", difference.figure, difference.accepted,
               difference.now);
  }
  if (moved.empty()) return kMet;
  fmt::print(stderr, "{} figures moved by more than {:g} (relative); accept with --update\n",
             moved.size(), accepted.tolerance());
  return kNotMet;
}

int replaySequence(const ReplayArguments& arguments) {
  if (arguments.update && arguments.baseline.empty())
    refuseOption("--update", "needs --baseline FILE");
  const Sequence sequence(arguments.sequence, arguments.source);
  const ReplayOptions options = optionsOf(arguments, sequence);
  if (!arguments.baseline.empty() && !arguments.update) Baseline::load(arguments.baseline);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);

  RunLog log;
  {
    ProgressBar bar("replay " + sequence.name());
    log = replay(sequence, options, [&](double done) { bar.show(done); });
  }
  if (!arguments.out.empty()) writeRunFolder(log, arguments.out);
  for (const std::string& warning : sequence.warnings()) fmt::print(stderr, "note: {}\n", warning);
  printTable(log);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(log));
  return arguments.baseline.empty() ? kMet : compare(log, arguments.baseline, arguments.update);
}

}  // namespace

void addReplay(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("replay", "Observe depth on recorded data");
  auto a = std::make_shared<ReplayArguments>();
  command->add_option("SEQUENCE", a->sequence, "Folder: see doc/formats.md")->required();
  command
      ->add_option("--tracker", a->tracker, "dots | tracks; default: dots where there are images")
      ->type_name("NAME");
  addObservationOptions(*command, a->observation);
  command
      ->add_option("--motion", a->motion,
                   "twist | groundtruth | target; default: the first that the sequence has")
      ->type_name("SOURCE");
  command
      ->add_option(
          "--camera", a->source.camera,
          "camera_info or EuRoC sensor.yaml, or tum-fr1 | tum-fr2 | tum-fr3 | icl; default: "
          "camera.yaml")
      ->type_name("FILE");
  command
      ->add_option("--fps", a->source.fps,
                   "Images per second of a plain image folder, or of frame numbers")
      ->type_name("F")
      ->check(CLI::PositiveNumber);
  command->add_option("--observe", a->observe, "depth (default) | focal")->type_name("WHAT");
  command
      ->add_option("--baseline", a->baseline,
                   "Compare with accepted figures; exit 1 when one moved")
      ->type_name("FILE");
  command->add_flag("--update", a->update, "Accept the figures: write them to the baseline");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->add_option("--out", a->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  command->callback([a, &exitCode] { exitCode = replaySequence(*a); });
}

}  // namespace depthservo
