// A robot in a simulation returns to a taught image of textured walls.

#include <gtest/gtest.h>

#include <cmath>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kWall = data("scenarios/omni-wall.yaml");

TEST(Wall, the_shipped_scenario_returns_to_what_is_taught_at_its_start) {
  const TemporaryFolder folder;
  const Result run = depthservo("run " + kWall + " --json --out " + (folder / "out").string());
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto frames = readCsv(folder / "out" / "frames.csv");
  EXPECT_NEAR(std::stod(frames.at("robot_x").back()), -1.5, 0.02);
  EXPECT_NEAR(std::stod(frames.at("robot_y").back()), 0, 0.02);
  EXPECT_NEAR(std::stod(frames.at("robot_theta").back()), 0, 0.01);
  const auto features = readCsv(folder / "out" / "features.csv");
  double worst = 0;
  for (std::size_t i = features.at("Z").size() - 8; i < features.at("Z").size(); ++i) {
    const double truth = std::stod(features.at("Z_true")[i]);
    worst = std::max(worst, std::abs(std::stod(features.at("Z")[i]) / truth - 1));
  }
  EXPECT_LT(worst, 0.15) << "depths of corners that nobody told";
}

TEST(Wall, taught_corners_are_where_the_simulation_has_them) {
  // Points projected, not seen: at the goal nothing is left of the error.
  const Result run = depthservo("run " + kWall +
                                " --json --set sensing.source=geometry --set depth.estimator=true "
                                "--set control.tolerance=0.01 --set 'odometry={rate: 100}'");
  EXPECT_EQ(run.exitCode, 0) << run.err;
}

TEST(Wall, a_recorded_run_gives_the_same_estimates_and_commands) {
  const TemporaryFolder folder;
  const std::string shortly = kWall + " --set duration=1.5 --set expect=null";
  const auto path = [&](const char* name) { return (folder / name).string(); };
  ASSERT_EQ(depthservo("run " + shortly + " --out " + path("run")).exitCode, 0);
  record(shortly, path("sequence"));
  const Result replay = depthservo("replay " + path("sequence") + " --law recorded --commands " +
                                   path("again.csv") + " --out " + path("replayed"));
  ASSERT_EQ(replay.exitCode, 0) << replay.err;
  expectSameEstimates(path("run"), path("replayed"), 0);
  EXPECT_EQ(folder.read("again.csv"), folder.read("sequence/commands.csv"));
  const Result task = depthservo("replay " + path("sequence") + " --law task --json");
  ASSERT_EQ(task.exitCode, 0) << task.err;
  EXPECT_LT(task.json()["law"]["same"], 5) << "another law commands otherwise";
}

TEST(Wall, its_goal_can_be_a_folder_of_teach) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  record(kWall +
             " --set duration=0.02 --set expect=null --set "
             "'robot.initial={x: -1.5, y: 0, theta: 0}'",
         path("seen"));
  const std::string teach = "teach --source " + path("seen/rgb/000001.png") + " --camera " +
                            path("seen/camera.yaml") + " --tracker klt --corners 16 --out ";
  ASSERT_EQ(depthservo(teach + path("goal")).exitCode, 0);
  const Result run = depthservo("run " + kWall + " --json --set control.taught=" + path("goal"));
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(run.json()["points"].size(), 16u);
  expectRefused(depthservo("run " + kWall + " --set control.taught=" + path("none")), {"none"});
  expectRefused(depthservo("run " + data("scenarios/unicycle-4dots.yaml") +
                           " --set control.taught=" + path("goal")),
                {"control.taught", "wall"});
}

TEST(Wall, what_cannot_be_taught_or_found_is_refused) {
  expectRefused(depthservo("run " + kWall + " --set robot.initial.theta=3"),
                {"robot.initial", "not found"});
  expectRefused(depthservo("run " + kWall + " --set sensing.corners=4"), {"sensing.corners", "8"});
  expectRefused(depthservo("run " + kWall + " --set 'control.desired=[[1, 2]]'"),
                {"control.desired"});
}

/// Images that come late, and points that are projected: the commands of a recording, again.
TEST(RecordedLaw, commands_are_the_same_when_images_come_late) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  record(data("scenarios/unicycle-4dots.yaml") +
             " --set sensing.source=geometry --set sensing.delay=0.05 --set duration=6 "
             "--set expect=null --set odometry.rate=77 --set 'sensing.hidden=[[2, 3]]'",
         path("late"));
  const Result again =
      depthservo("replay " + path("late") + " --law recorded --commands " + path("again.csv"));
  EXPECT_EQ(again.exitCode, 0) << again.err;
  EXPECT_EQ(folder.read("again.csv"), folder.read("late/commands.csv"));
  EXPECT_GT(folder.read("again.csv").size(), 5000u);
}

}  // namespace
}  // namespace depthservo::test
