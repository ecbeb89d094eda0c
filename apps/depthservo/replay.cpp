#include <fmt/core.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "ProgressBar.h"
#include "Recording.h"
#include "commands.h"
#include "depthservo/experiments/Baseline.h"
#include "depthservo/experiments/FocalReplay.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/recordedLaw.h"
#include "depthservo/text/NewFolder.h"
#include "findings.h"
#include "numbers.h"
#include "observation.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

struct ReplayArguments {
  std::string sequence, baseline, out, law, commands, observe = "depth";
  SequenceArguments data;
  RecordingFiles files;
  std::vector<double> focalGains;
  bool update = false, json = false;
};

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

void printFocal(const FocalReplay& replay) {
  fmt::print(stderr, "{}: {} frames, {:.2f} s\n", replay.name, replay.frames, replay.duration_s);
  for (const FocalPoint& point : replay.points) {
    const FocalEstimate& e = point.estimate;
    fmt::print(stderr,
               "  point {}: focal length {:.5g} +- {:.2g} px (2 sigma), {}{}{}; eta1 {:.3g}, eta2 "
               "{:.3g} px rad/s, sigma_min {:.3g}; measured in {} frames\n",
               point.id, e.focal_px, 2 * e.sigma_focal_px, toString(e.status),
               point.unexcited_because.empty() ? "" : ": ", point.unexcited_because, e.eta1, e.eta2,
               e.sigma_min, point.measured_frames);
  }
  fmt::print(stderr, "focal length {:.5g} px, {}; the camera file says {:.6g} px. {}\n",
             replay.focal_px, toString(replay.status), replay.camera.fx, remark(replay));
}

int replayFocalLength(const ReplayArguments& arguments, const Sequence& sequence,
                      const ObservationOptions& options) {
  if (!arguments.baseline.empty()) refuseOption("--baseline", "is for --observe depth");
  if (!arguments.files.mcap.empty()) refuseOption("--mcap", "is for --observe depth");
  if (!arguments.files.tum.empty()) refuseOption("--tum", "is for --observe depth");
  FocalReplayOptions focal;
  focal.replay = options;
  if (!arguments.data.observation.prior.empty()) focal.Z = options.depth.initial;
  if (arguments.focalGains.size() == 3) {
    focal.gains = {arguments.focalGains[0], arguments.focalGains[1], arguments.focalGains[2]};
  }
  FocalReplay result;
  {
    RunProgress progress("replay " + sequence.name(), sequence.frames().front().time_s,
                         sequence.frames().back().time_s);
    result = replayFocal(sequence, focal, &progress);
  }
  if (!arguments.out.empty()) writeFocalFolder(result, arguments.out);
  printFocal(result);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(result));
  return kMet;
}

/// How many commands are those of the recording, to the last bit.
struct LawComparison {
  std::size_t recorded = 0, computed = 0, same = 0;
  Eigen::VectorXd greatest;  ///< difference, by velocity
};

LawComparison compare(const std::vector<LawCommand>& recorded,
                      const std::vector<LawCommand>& computed, Eigen::Index velocities) {
  LawComparison result{recorded.size(), computed.size(), 0, Eigen::VectorXd::Zero(velocities)};
  auto then = recorded.begin();
  for (const LawCommand& now : computed) {
    while (then != recorded.end() && then->time_s < now.time_s) ++then;
    if (then == recorded.end() || then->time_s != now.time_s) continue;
    result.same += lawCommandLine(*then) == lawCommandLine(now);
    result.greatest = result.greatest.cwiseMax((then->velocities - now.velocities).cwiseAbs());
  }
  return result;
}

bool areSame(const LawComparison& c) { return c.same == c.recorded && c.same == c.computed; }

void printLaw(const std::string& law, const LawComparison& c,
              const std::vector<std::string>& names) {
  fmt::print(stderr, "law {}: {} commands, {} of {} recorded ones are the same to the last bit",
             law, c.computed, c.same, c.recorded);
  for (std::size_t i = 0; i < names.size() && !areSame(c); ++i) {
    fmt::print(stderr, "{} {:.3g} in {}", i == 0 ? "; they differ by up to" : ",",
               c.greatest[static_cast<Eigen::Index>(i)], names[i]);
  }
  fmt::print(stderr, "\n");
}

/// What the law commands by what was recorded.
int replayCommands(const ReplayArguments& arguments, const Sequence& sequence,
                   const ObservationOptions& options) {
  if (arguments.observe != "depth" || !arguments.baseline.empty()) {
    refuseOption("--law", "goes without --observe focal and --baseline");
  }
  if (arguments.law != "recorded" && arguments.law != "vpServo" && arguments.law != "task") {
    refuseWord("--law", arguments.law, {"recorded", "vpServo", "task"});
  }
  const RecordedLaw law = readLaw(arguments.sequence, arguments.law);
  if (!arguments.commands.empty()) requireNewFile(arguments.commands);
  LawReplay replay;
  {
    RunProgress progress("replay " + sequence.name(), sequence.frames().front().time_s,
                         sequence.frames().back().time_s);
    Recording recorder(arguments.files, &progress);
    replay = replayLaw(sequence, options, law, &recorder);
    recorder.finish(replay.log);
  }
  const std::vector<std::string>& names = replay.log.commandNames;
  if (!arguments.out.empty()) writeRunFolder(replay.log, arguments.out);
  if (!arguments.commands.empty()) {
    std::string text = lawCommandHeader(names);
    for (const LawCommand& command : replay.commands) text += lawCommandLine(command);
    makeFile(arguments.commands, text);
  }
  const auto c = compare(law.commands, replay.commands, static_cast<Eigen::Index>(names.size()));
  const Metrics metrics = computeMetrics(replay.log);
  printTable(replay.log, metrics);
  printLaw(arguments.law, c, names);
  if (arguments.json) {
    auto json = nlohmann::ordered_json::parse(toJson(replay.log, metrics));
    json["law"] = {
        {"law", arguments.law},
        {"commands", c.computed},
        {"recorded", c.recorded},
        {"same", c.same},
        {"greatest_difference", std::vector<double>(c.greatest.begin(), c.greatest.end())}};
    fmt::print("{}\n", json.dump());
  }
  return arguments.law != "recorded" || areSame(c) ? kMet : kNotMet;
}

int replaySequence(const ReplayArguments& arguments) {
  if (arguments.update && arguments.baseline.empty())
    refuseOption("--update", "needs --baseline FILE");
  if (arguments.observe != "depth" && arguments.observe != "focal") {
    refuseWord("--observe", arguments.observe, {"depth", "focal"});
  }
  const Sequence sequence(pathOrShipped(arguments.sequence), arguments.data.source);
  const ObservationOptions options = optionsOf(arguments.data, sequence);
  if (!arguments.baseline.empty() && !arguments.update) Baseline::load(arguments.baseline);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);

  if (!arguments.law.empty()) return replayCommands(arguments, sequence, options);
  if (!arguments.commands.empty()) refuseOption("--commands", "needs --law");
  if (arguments.observe == "focal") return replayFocalLength(arguments, sequence, options);
  if (!arguments.focalGains.empty()) refuseOption("--focal-gains", "is for --observe focal");
  RunLog log;
  {
    RunProgress progress("replay " + sequence.name(), sequence.frames().front().time_s,
                         sequence.frames().back().time_s);
    Recording recorder(arguments.files, &progress);
    log = replay(sequence, options, &recorder);
    recorder.finish(log);
  }
  if (!arguments.out.empty()) writeRunFolder(log, arguments.out);
  for (const std::string& warning : sequence.warnings()) fmt::print(stderr, "note: {}\n", warning);
  const Metrics metrics = computeMetrics(log);
  printTable(log, metrics);
  printFindings(log);
  if (!arguments.out.empty()) fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  if (arguments.json) fmt::print("{}\n", toJson(log, metrics));
  if (foundNothing(log, metrics)) return kOtherOutcome;
  return arguments.baseline.empty() ? kMet : compare(log, arguments.baseline, arguments.update);
}

}  // namespace

void addReplay(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("replay", "Observe depth on recorded data");
  auto a = std::make_shared<ReplayArguments>();
  command->add_option("SEQUENCE", a->sequence, "Folder or bag: see doc/formats.md")->required();
  addEstimatorOption(*command, a->data.observation);
  addSequenceOptions(*command, a->data);
  command->add_option("--observe", a->observe, "depth (default) | focal")->type_name("WHAT");
  command
      ->add_option("--focal-gains", a->focalGains,
                   "Gains of --observe focal, for pixels; default: for the motion at hand")
      ->type_name("K,K3,K4")
      ->delimiter(',')
      ->expected(3)
      ->check(aboveZero());
  command
      ->add_option("--baseline", a->baseline,
                   "Compare with accepted figures; exit 1 when one moved")
      ->type_name("FILE");
  command
      ->add_option("--law", a->law,
                   "Compute the commands of a recording of servo or record again: recorded (exit 1 "
                   "when one is not the same to the last bit) | vpServo | task")
      ->type_name("NAME");
  command->add_option("--commands", a->commands, "Write them, as commands.csv of the recording")
      ->type_name("FILE");
  command->add_flag("--update", a->update, "Accept the figures: write them to the baseline");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->add_option("--out", a->out, "Write a run folder with report.html; must not exist")
      ->type_name("DIR");
  addRecordingOptions(*command, a->files);
  command->callback([a, &exitCode] { exitCode = replaySequence(*a); });
}

}  // namespace depthservo
