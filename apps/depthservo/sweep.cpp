#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "Interruption.h"
#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/text/InputError.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

struct SweepArguments {
  std::string sweep, out, shard;
  int jobs = 0;
  bool dryRun = false, json = false;
};

/// "3/8". \throw InputError
SweepShard shardNamed(const std::string& text) {
  SweepShard shard;
  if (text.empty()) return shard;
  const std::size_t slash = text.find('/');
  const auto number = [&](const std::string& digits) {
    constexpr std::size_t kMostDigits = 6;
    const bool isNumber = !digits.empty() && digits.size() <= kMostDigits &&
                          digits.find_first_not_of("0123456789") == std::string::npos;
    return isNumber ? std::stoul(digits) : 0UL;
  };
  if (slash != std::string::npos) {
    shard.index = number(text.substr(0, slash));
    shard.count = number(text.substr(slash + 1));
  }
  if (slash == std::string::npos || shard.index < 1 || shard.index > shard.count) {
    throw InputError({"--shard", 0, ""},
                     "expected i/n, 1 <= i <= n, for instance 3/8; got '" + text + "'");
  }
  return shard;
}

std::string inWords(double seconds) {
  if (!std::isfinite(seconds)) return "";
  const auto whole = static_cast<long long>(std::ceil(seconds));
  if (whole < 100) return fmt::format("{} s left", whole);
  if (whole < 6000) return fmt::format("{} min left", (whole + 59) / 60);
  return fmt::format("{} h {:02} min left", whole / 3600, whole % 3600 / 60);
}

/// What the folder now says. \return exit code
int tellResults(const std::string& folder, bool json) {
  const SweepFolder results = SweepFolder::open(folder);
  const std::string summary = sweepJson(results.sweep(), results.results());
  if (json) fmt::print("{}\n", summary);
  fmt::print(stderr, "{}\n", sweepVerdict(results.sweep(), results.results()));
  bool isMet = true;
  for (const JudgedClaim& claim : judgedClaims(results.sweep(), results.results())) {
    isMet = isMet && claim.pass;
    fmt::print(stderr, "{:4} {}: {:.6g}, expected {:.6g} ({})\n", claim.pass ? "ok" : "FAIL",
               claim.claim, claim.ours, claim.expected, claim.tolerance);
  }
  fmt::print(stderr, "report: {}/report.html\n", folder);
  return isMet ? kMet : kNotMet;
}

bool runMissing(SweepFolder& folder, const SweepArguments& a, const std::atomic<bool>& isCancelled) {
  const std::string& name = folder.sweep().options().name;
  SweepProgress last;
  bool isComplete = false;
  {
    ProgressBar bar(name);
    isComplete = runSweep(
        folder, a.jobs, [&] { return isCancelled.load(); },
        [&](const SweepProgress& now) {
          last = now;
          bar.show(static_cast<double>(now.done) / static_cast<double>(std::max<std::size_t>(1, now.total)),
                   fmt::format("{} of {} runs, {}", now.done, now.total, inWords(now.left_s())));
        });
  }
  if (last.doneNow > 0) {
    fmt::print(stderr, "{}: {} runs in {:.1f} s, {:.3g} per second\n", name, last.doneNow,
               last.elapsed_s, static_cast<double>(last.doneNow) / last.elapsed_s);
  }
  if (!isComplete) {
    fmt::print(stderr, "{}: {} of {} runs are done; the same command goes on\n", name, last.done,
               last.total);
  }
  return isComplete;
}

int sweepAll(const SweepArguments& a) {
  const SweepShard shard = shardNamed(a.shard);
  const Sweep sweep = Sweep::load(shippedFile(a.sweep, "sweeps"), scenarioFile);
  if (a.dryRun) {
    fmt::print(stderr, "{}: {} runs\n", sweep.options().name, shard.sizeOf(sweep.size()));
    return kMet;
  }
  const std::atomic<bool>& isCancelled = stopOnInterruption();
  {
    SweepFolder folder = SweepFolder::begin(a.out, sweep, shard);
    if (!runMissing(folder, a, isCancelled)) return kInterrupted;
  }
  writeSweepReport(a.out, shard.count == 1);
  return tellResults(a.out, a.json);
}

struct MergeArguments {
  std::vector<std::string> shards;
  std::string out;
  bool json = false;
};

int merge(const MergeArguments& a) {
  mergeSweeps({a.shards.begin(), a.shards.end()}, a.out);
  return tellResults(a.out, a.json);
}

}  // namespace

void addSweep(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand(
      "sweep", "Many runs of a scenario: success maps, curves, claims (doc/sweeps.md)");
  auto a = std::make_shared<SweepArguments>();
  command->add_option("SWEEP", a->sweep, "YAML file, or name of a shipped sweep")->required();
  command
      ->add_option("--out", a->out,
                   "Folder of the results; one that was begun by the same sweep is gone on with")
      ->type_name("DIR");
  command->add_option("--shard", a->shard, "Only the i-th of n parts of the runs; see merge")
      ->type_name("I/N");
  command->add_option("--jobs", a->jobs, "Threads; default: one for each processor")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
  command->add_flag("--dry-run", a->dryRun, "Check the sweep and say how many runs it has");
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a, &exitCode] {
    if (a->out.empty() && !a->dryRun) {
      throw InputError({"--out", 0, ""}, "is missing; name the folder of the results");
    }
    exitCode = sweepAll(*a);
  });
}

void addMerge(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("merge", "Join the shards of a sweep");
  auto a = std::make_shared<MergeArguments>();
  command->add_option("SHARD_DIR", a->shards, "Folders written by sweep --shard, in any order")
      ->required();
  command->add_option("--out", a->out, "Folder of the whole; must not exist")
      ->type_name("DIR")
      ->required();
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a, &exitCode] { exitCode = merge(*a); });
}

}  // namespace depthservo
