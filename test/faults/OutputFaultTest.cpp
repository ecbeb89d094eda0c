// Every output call of every command that writes fails in turn, or the tool is killed at it: what
// was named is there whole or not at all, and the same command can be given again.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "faults/Faults.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

const std::string kScenario = data("scenarios/unicycle-4dots.yaml") + " --set expect=null";
const std::string kPoints = kScenario + " --set sensing.source=geometry --set duration=0.2";

const char* const kSweep =
    "name: short\ntitle: A short one\nset: [sensing.source=geometry, duration=0.2, expect=null, "
    "camera.rate=10]\n"
    "axes: [{name: estimator, key: depth.estimator, values: [filter, constant]}]\n"
    "success: [timeout, converged]\nworst: 1\n";

/// What the commands read and what is there before them: made once, where a command names it.
class Inputs {
 public:
  explicit Inputs(const std::string& command) {
    const auto isNamed = [&](const char* name) { return command.find(name) != std::string::npos; };
    fs::create_directory(folder_ / "before");
    if (isNamed("#sequence")) record(kScenario + " --set duration=0.1", path("sequence"));
    if (isNamed("#drive")) {
      record(data("scenarios/free-general.yaml") + " --set duration=1.2", path("drive"));
    }
    folder_.write("sweep.yaml", std::string(kSweep) +
                                    "scenario: " + data("scenarios/unicycle-4dots.yaml") + "\n");
    for (const std::string shard : {"1", "2"}) {
      if (!isNamed("#shard")) break;
      make("sweep " + path("sweep.yaml") + " --shard " + shard + "/2 --out " +
           path("shard" + shard));
    }
    if (isNamed("@/run")) makeRun();
    if (isNamed("@/baseline.json")) {
      make("replay " + path("sequence") + " --baseline " + path("before/baseline.json") +
           " --update");
    }
  }
  std::string path(const std::string& name) const { return folder_ / name; }

 private:
  static void make(const std::string& command) {
    const Result result = depthservo(command, "PATH=/nowhere");
    EXPECT_EQ(result.exitCode, 0) << command << "\n" << result.err;
  }
  void makeRun() const {
    make("run " + kPoints + " --out " + path("run"));
    fs::create_directory(folder_ / "before/run");
    for (const char* file : {"run.json", "frames.csv", "features.csv"}) {
      fs::copy(folder_ / "run" / file, folder_ / "before/run" / file);
    }
    folder_.write("before/run/report.html", "the old one\n");
  }

  TemporaryFolder folder_;
};

enum class Again { makesIt, goesOn };

struct Writer {
  const char* name;
  std::string command;  ///< @ stands for the folder that it writes below, # for that of the inputs
  Again again = Again::makesIt;  ///< goesOn: a folder that is not whole yet is finished later
};

std::ostream& operator<<(std::ostream& out, const Writer& writer) { return out << writer.name; }

std::string replaced(std::string text, char mark, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += by.size()) {
    text.replace(at, 1, by);
  }
  return text;
}

bool isMade(const Tree& tree, const std::string& name) {
  return std::any_of(tree.begin(), tree.end(), [&](const auto& entry) {
    return entry.first == name || entry.first.rfind(name + "/", 0) == 0;
  });
}

/// That of one file or folder with all that is below it.
Tree partOf(const Tree& tree, const std::string& name) {
  Tree part;
  for (const auto& [path, contents] : tree) {
    if (path == name || path.rfind(name + "/", 0) == 0) part[path] = contents;
  }
  return part;
}

class OutputFault : public testing::TestWithParam<Writer> {
 protected:
  void SetUp() override {
    reset();
    before_ = treeOf(place());
    const Result result = run(0, "kill");
    ASSERT_EQ(result.exitCode, 0) << result.err;
    calls_ = toldCalls(told());
    ASSERT_GT(calls_.writing, 0) << "nothing was written below " << place();
    whole_ = treeOf(place());
    ASSERT_NE(whole_, before_);
    expectNoRests();
  }

  std::string place() const { return folder_ / "place"; }
  std::string told() const { return folder_ / "told"; }

  void reset() const {
    fs::remove_all(place());
    fs::copy(inputs_.path("before"), place(), fs::copy_options::recursive);
  }

  /// gnuplot takes most of the time: there is none.
  Result run(int at, const std::string& kind) const {
    const std::string command =
        replaced(replaced(GetParam().command, '@', place()), '#', inputs_.path(""));
    return depthservo(command, "PATH=/nowhere " + faultAt(at, kind, place(), told()));
  }

  void expectNoRests() const {
    for (const auto& entry : fs::recursive_directory_iterator(place())) {
      const std::string name = entry.path().filename();
      EXPECT_FALSE(name[0] == '.' || entry.path().extension() == ".part") << entry.path();
    }
  }

  /// Each thing that was to be made: as it was before, or whole.
  void expectWholeOrAsBefore() const {
    const Tree now = treeOf(place());
    for (const auto& entry : fs::directory_iterator(place())) {
      const std::string name = entry.path().filename();
      const Tree part = partOf(now, name);
      if (GetParam().again == Again::goesOn || part == partOf(before_, name)) continue;
      for (const auto& [path, contents] : part) EXPECT_EQ(whole_.count(path), 1u) << path;
      EXPECT_TRUE(part == partOf(whole_, name)) << name << " is neither whole nor as before";
    }
    for (const auto& [path, contents] : before_) EXPECT_TRUE(isMade(now, path)) << path;
  }

  /// The same command again, undisturbed.
  void expectItCanBeGivenAgain() const {
    const Result again = run(0, "kill");
    if (again.exitCode != 0) {
      EXPECT_NE(again.err.find("exists already"), std::string::npos) << again.err;
    } else {
      EXPECT_TRUE(treeOf(place()) == whole_);
    }
  }

  /// One of the kinds, another for each command; all of them in scripts/test-long.
  std::vector<std::string> some(const std::vector<std::string>& kinds) const {
    if (areAllTried()) return kinds;
    return {kinds[std::hash<std::string>()(GetParam().name) % kinds.size()]};
  }
  void expectFailures(const std::string& kind) const;
  void expectNothingSeen(const std::string& kind) const;
  void expectKillsAreSurvived() const;

  Inputs inputs_{GetParam().command};
  TemporaryFolder folder_;
  Tree before_, whole_;
  OutputCalls calls_;
};

void OutputFault::expectFailures(const std::string& kind) const {
  for (const int at : callsToTry(calls_.of(kind), 1, static_cast<unsigned>(kind.size()))) {
    reset();
    const Result result = run(at, kind);
    SCOPED_TRACE(kind + " at " + std::to_string(at) + ": " + toldCalls(told()).failed + ": " +
                 result.err);
    if (result.exitCode == 0) {  // it did not matter
      EXPECT_TRUE(treeOf(place()) == whole_);
      continue;
    }
    EXPECT_EQ(result.exitCode, 2);
    const std::string line = result.err.substr(
        result.err.find_last_of('\n', std::max<std::size_t>(result.err.size(), 2) - 2) + 1);
    EXPECT_EQ(line.rfind(place() + "/", 0), 0u) << "names the place";
    EXPECT_EQ(line.find("/."), std::string::npos) << "names what nobody has heard of";
    expectWholeOrAsBefore();
    if (GetParam().again == Again::goesOn) {
      expectItCanBeGivenAgain();
    } else {
      expectNoRests();
    }
  }
}

void OutputFault::expectNothingSeen(const std::string& kind) const {
  for (const int at : callsToTry(calls_.of(kind), 1, static_cast<unsigned>(kind.size()))) {
    reset();
    const Result result = run(at, kind);
    SCOPED_TRACE(kind + " at " + std::to_string(at) + ": " + result.err);
    EXPECT_EQ(result.exitCode, 0);
    EXPECT_TRUE(treeOf(place()) == whole_);
  }
}

void OutputFault::expectKillsAreSurvived() const {
  for (const int at : callsToTry(calls_.of("kill"), 1, 3)) {
    reset();
    const Result result = run(at, "kill");
    SCOPED_TRACE("killed at " + std::to_string(at) + ": " + toldCalls(told()).failed);
    EXPECT_EQ(result.exitCode, 137);
    expectWholeOrAsBefore();
    expectItCanBeGivenAgain();
  }
}

TEST_P(OutputFault, is_told_or_not_seen_and_leaves_nothing_half) {
  expectFailures("full");
  for (const std::string& kind : some({"io", "read-only", "file-limit"})) expectFailures(kind);
  for (const std::string& kind : some({"interrupted", "short"})) expectNothingSeen(kind);
  expectKillsAreSurvived();
}

INSTANTIATE_TEST_SUITE_P(
    Of, OutputFault,
    testing::Values(Writer{"run", "run " + kPoints + " --out @/x"},
                    Writer{"run_with_recordings",
                           "run " + kPoints + " --mcap @/x.mcap --tum @/x.txt"},
                    Writer{"record", "record " + kScenario + " --set duration=0.04 @/x"},
                    Writer{"replay", "replay #sequence --out @/x"},
                    Writer{"replay_with_a_new_baseline",
                           "replay #sequence --prior 3 --baseline @/baseline.json --update"},
                    Writer{"compare", "compare #sequence --estimators filter --out @/x"},
                    Writer{"sweep", "sweep #sweep.yaml --jobs 1 --out @/x", Again::goesOn},
                    Writer{"merge", "merge #shard1 #shard2 --out @/x"},
                    Writer{"report", "report @/run"}, Writer{"target", "target dots --out @/x.pdf"},
                    Writer{"new_scenario", "new @/x.yaml"},
                    Writer{"calibrate", "calibrate #drive --out @/x.yaml"},
                    Writer{"teach",
                           "teach --source #sequence/rgb/000001.png --camera #sequence/camera.yaml "
                           "--tracker dots --out @/x"}),
    [](const auto& writer) { return std::string(writer.param.name); });

}  // namespace
}  // namespace depthservo::test
