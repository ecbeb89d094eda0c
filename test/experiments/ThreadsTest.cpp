// What may be used from several threads is; what each thread has for itself shares nothing with that of
// another. The thread sanitizer watches (preset `tsan`).

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/scenario/run.h"
#include "depthservo/sequence/PushedSources.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/text/NewFolder.h"
#include "depthservo/visp/using.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

constexpr int kThreads = 3;

/// In as many threads at once, each with its number.
void inThreads(const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) threads.emplace_back(work, i);
  for (std::thread& thread : threads) thread.join();
}

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

TEST(Threads, every_pushed_row_is_read_once_or_refused) {
  constexpr int kRows = 2000;
  PushedTwists twists;
  std::atomic<int> time{0};
  std::vector<OdometryRow> read;
  std::thread reader([&] {
    while (!twists.isEnded()) {
      const std::vector<OdometryRow> rows = twists.read(0.01);
      read.insert(read.end(), rows.begin(), rows.end());
      twists.takeFaults();
    }
  });
  inThreads([&](int) {
    for (int i = 0; i < kRows; ++i) twists.push({static_cast<double>(++time), {}});
  });
  twists.end();
  reader.join();
  twists.read(0);
  EXPECT_EQ(read.size(), twists.counts().rows);
  EXPECT_EQ(read.size() + twists.counts().notLater, static_cast<std::size_t>(kThreads * kRows));
  for (std::size_t i = 1; i < read.size(); ++i) EXPECT_LT(read[i - 1].time_s, read[i].time_s);
}

TEST(Threads, every_pushed_image_is_taken_or_left_out) {
  constexpr int kImages = 500;
  PushedImages::Options options;
  options.most = 4;
  PushedImages images(options);
  std::size_t taken = 0;
  std::thread reader([&] {
    for (TimedImage image; images.next(image) == ImageStatus::image; ++taken) {
      EXPECT_EQ(image.image.getSize(), 16u);
    }
  });
  inThreads([&](int) {
    for (int i = 0; i < kImages; ++i) images.push({0.1 * i, vpImage<unsigned char>(4, 4, 7)});
  });
  images.end("enough");
  reader.join();
  EXPECT_EQ(taken + images.leftOut(), static_cast<std::size_t>(kThreads * kImages));
  EXPECT_EQ(images.reason(), "enough");
}

TEST(Threads, read_the_images_of_one_bag) {
  const Sequence bag(std::string(DEPTHSERVO_BAGS) + "/lz4.mcap");
  std::vector<vpImage<unsigned char>> alone;
  for (std::size_t k = 0; k < bag.frames().size(); ++k) alone.push_back(bag.readImage(k));
  inThreads([&](int first) {
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const std::size_t k = (i + 2 * static_cast<std::size_t>(first)) % alone.size();
      EXPECT_TRUE(bag.readImage(k) == alone[k]) << k;
    }
  });
}

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

/// The mask of the process stays, too: whoever asks for it by setting it may leave another's.
TEST(Threads, make_folders_and_files_of_their_own) {
  constexpr int kFolders = 30;
  const TemporaryFolder place;
  const mode_t mask = umask(027);
  inThreads([&](int thread) {
    for (int i = 0; i < kFolders; ++i) {
      const std::string name = std::to_string(thread) + "-" + std::to_string(i);
      makeFolder(place / name, [&](const auto& folder) { makeFile(folder / "file", name); });
      struct stat made = {};
      EXPECT_EQ(stat((place / name).c_str(), &made), 0);
      EXPECT_EQ(made.st_mode & 0777u, 0750u);
      EXPECT_EQ(place.read(name + "/file"), name);
    }
  });
  EXPECT_EQ(umask(mask), 027u);
}

}  // namespace
}  // namespace depthservo::test
