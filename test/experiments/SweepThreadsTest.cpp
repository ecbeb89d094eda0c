// Runs of several threads share nothing, and a sweep puts them together. The thread sanitizer watches (preset `tsan`).

#include <gtest/gtest.h>

#include <atomic>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/scenario/run.h"
#include "support/TemporaryFolder.h"
#include "support/inThreads.h"

namespace depthservo::test {
namespace {

std::string scenarioFile(const std::string& name) {
  return std::string(DEPTHSERVO_DATA) + "/scenarios/" + name + ".yaml";
}

Sweep sweepOf(const std::string& lines) {
  const TemporaryFolder folder;
  folder.write("sweep.yaml", "name: s\nscenario: unicycle-4dots\n" + lines);
  return Sweep::load(folder / "sweep.yaml", scenarioFile);
}

const std::string kGuesses =
    "set: [sensing.source=geometry, duration=0.5, expect=null]\n"
    "axes: [{name: guess, key: depth.initial, from: 1, to: 100, count: 24, log: true}]\n";

TEST(Threads, run_scenarios_of_their_own_as_if_they_were_alone) {
  const std::vector<std::string> settings{"duration=0.5", "expect=null", "depth.estimator=joint"};
  const Scenario scenario = Scenario::load(scenarioFile("unicycle-4dots"), settings);
  const auto depthsOf = [](const RunLog& log) {
    std::vector<double> depths;
    for (const FrameRecord& frame : log.frames) {
      for (const FeatureRecord& f : frame.features) depths.push_back(f.estimate.chi);
    }
    return depths;
  };
  const std::vector<double> alone = depthsOf(run(scenario));
  ASSERT_GT(alone.size(), 20u);
  inThreads([&](int) { EXPECT_EQ(depthsOf(run(scenario)), alone); });
}

/// In threads of its own: what TBB's hand to each other the sanitizer does not see.
TEST(Threads, run_rows_of_one_sweep_as_if_they_were_alone) {
  const Sweep sweep = sweepOf(kGuesses);
  const auto result = [&](std::size_t row) { return runRow(sweep, row, [] { return false; }); };
  std::vector<SweepResult> alone;
  for (std::size_t row = 0; row < sweep.size(); ++row) alone.push_back(result(row));
  std::vector<SweepResult> results(sweep.size());
  inThreads([&](int first) {
    for (auto row = static_cast<std::size_t>(first); row < sweep.size(); row += kThreads) {
      results[row] = result(row);
    }
  });
  EXPECT_EQ(results, alone);
}

TEST(Threads, of_a_sweep_do_each_run_once) {
  const Sweep sweep = sweepOf(kGuesses);
  const TemporaryFolder place;
  SweepFolder folder = SweepFolder::begin(place / "out", sweep, {});
  SweepProgress last;
  EXPECT_TRUE(runSweep(
      folder, kThreads, [] { return false; }, [&](const SweepProgress& now) { last = now; }));
  EXPECT_EQ(last.done, sweep.size());
  EXPECT_EQ(last.doneNow, sweep.size());
  std::vector<std::size_t> rows;
  std::vector<SweepResult> alone;
  for (std::size_t row = 0; row < sweep.size(); ++row) {
    rows.push_back(row);
    alone.push_back(runRow(sweep, row, [] { return false; }));
  }
  EXPECT_EQ(folder.results(), alone);
  EXPECT_EQ(runRows(sweep, rows), alone);
}

TEST(Threads, of_a_sweep_stop_when_another_says_so) {
  const Sweep sweep = sweepOf(kGuesses + "repeat: 100\n");
  const TemporaryFolder place;
  SweepFolder folder = SweepFolder::begin(place / "out", sweep, {});
  std::atomic<bool> isStopped{false};
  EXPECT_FALSE(runSweep(
      folder, kThreads, [&] { return isStopped.load(); },
      [&](const SweepProgress& now) { isStopped = isStopped || now.done > 0; }));
  EXPECT_FALSE(folder.results().empty());
  for (const SweepResult& result : folder.results()) EXPECT_FALSE(result.outcome.empty());
}

}  // namespace
}  // namespace depthservo::test
