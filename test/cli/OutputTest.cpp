#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

const std::string kQuickRun = data("scenarios/unicycle-4dots.yaml") +
                              " --set sensing.source=geometry --set expect=null --set duration=5";

std::string shellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

/// A folder may be called anything; what it is called is shown, and never executed.
TEST(Names, of_folders_are_never_executed) {
  const TemporaryFolder place;
  const std::string sequence = place / "sequence";
  record(kQuickRun, sequence);
  place.write("sequence/sequence.yaml", "replay: {prior: 3}\n");
  int n = 0;
  for (const std::string folder :
       {"x\nsystem(\"touch pwned\")\n#", "x'; system('touch pwned'); y='", "`touch pwned`",
        "$(touch pwned)", "x\" ; system(\"touch pwned\") #", "caf\xe9\n!touch pwned"}) {
    const std::string renamed = place / folder;
    fs::rename(sequence, renamed);
    const std::string quoted = shellQuoted(renamed), out = place / ("out" + std::to_string(n++));
    const Result compared =
        depthservo("compare " + quoted + " --estimators filter --out " + out + "c");
    EXPECT_EQ(compared.exitCode, 0) << compared.err;
    const Result replayed = depthservo("replay " + quoted + " --out " + out + "r");
    EXPECT_EQ(replayed.exitCode, 0) << replayed.err;
    depthservo("replay " + quoted + " --observe focal --out " + out + "f");
    fs::rename(renamed, sequence);
    for (const auto& entry : fs::recursive_directory_iterator(place.path())) {
      EXPECT_NE(entry.path().filename(), "pwned") << folder;
    }
    EXPECT_FALSE(fs::exists("pwned")) << folder;
  }
}

TEST(Record, leaves_nothing_when_it_is_interrupted) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder place;
    const Result result = depthservoInterrupted(
        "record " + data("scenarios/unicycle-4dots.yaml") + " " + (place / "sequence").string(),
        signal, [&] { return !place.isEmpty(); });
    EXPECT_EQ(result.exitCode, 128 + signal);
    EXPECT_TRUE(place.isEmpty());
  }
}

TEST(Replay, judges_corners_by_place_or_not_at_all) {
  const TemporaryFolder place;
  const std::string sequence = place / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set expect=null --set duration=3", sequence);
  const auto dots = depthservo("replay " + sequence + " --json").json();
  EXPECT_FALSE(dots["metrics"]["final_depth_error_max"].is_null());
  const Result corners = depthservo("replay " + sequence + " --tracker klt --json");
  ASSERT_EQ(corners.exitCode, 0) << corners.err;
  const auto json = corners.json();
  EXPECT_GT(json["points"].size(), 0u);
  EXPECT_TRUE(json["metrics"]["final_depth_error_max"].is_null())
      << "truth.csv is of the dots, not of the corners";
  EXPECT_TRUE(json["metrics"]["coverage_2sigma"].is_null());
}

TEST(Replay, by_the_targets_own_motion_speaks_of_agreement_and_gives_no_coverage) {
  const TemporaryFolder place;
  const std::string sequence = place / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set expect=null --set duration=3", sequence);
  fs::remove(sequence + "/truth.csv");
  const Result result = depthservo("replay " + sequence + " --motion target --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(result.json()["metrics"]["coverage_2sigma"].is_null());
  EXPECT_EQ(result.json()["truth_is_pose_of_motion"], true);
  EXPECT_NE(result.err.find("by the pose that told the motion"), std::string::npos) << result.err;
}

TEST(Run, of_constant_depths_says_that_they_are_given_and_nothing_of_excitation) {
  const Result result = depthservo("run " + kQuickRun + " --set depth.estimator=constant --json");
  const nlohmann::json json = result.json();
  EXPECT_EQ(json["observes_depth"], false);
  for (const auto& point : json["points"]) {
    EXPECT_TRUE(point["unexcited_because"].is_null());
  }
}

}  // namespace
}  // namespace depthservo::test
