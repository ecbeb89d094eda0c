// Servo on points and moments of a plate, with one depth for it or one for each point.
#include <gtest/gtest.h>

#include <filesystem>

#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

RunLog run(const std::string& scenario, const std::vector<std::string>& overrides = {}) {
  const std::string path = std::string(DEPTHSERVO_DATA) + "/scenarios/" + scenario + ".yaml";
  return run(Scenario::load(path, overrides));
}

TEST(DeadlockOfInconsistentDepths, happens_with_a_depth_for_each_point) {
  const RunLog log = run("unicycle-deadlock");
  EXPECT_EQ(log.outcome, Outcome::stalled) << log.reason;
  double nearest = 1e9, farthest = 0;
  for (const auto& feature : log.frames.back().features) {
    nearest = std::min(nearest, feature.estimate.Z());
    farthest = std::max(farthest, feature.estimate.Z());
  }
  EXPECT_GT(farthest, 2 * nearest) << "of dots that are equally far";
}

TEST(DeadlockOfInconsistentDepths, does_not_happen_with_one_depth_for_the_plate) {
  const RunLog log = run("unicycle-deadlock", {"depth.object=true"});
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_LT(computeMetrics(log).final_depth_error_max, 0.02);
}

TEST(DeadlockOfInconsistentDepths, does_not_happen_with_slower_gains) {
  EXPECT_EQ(run("unicycle-deadlock", {"depth.gains.k_3=8000"}).outcome, Outcome::converged);
}

TEST(MomentServo, reaches_the_goal_from_all_guesses_of_the_paper_through_images) {
  for (const char* guess : {"0.9", "3", "5", "8", "16"}) {
    for (const char* object : {"true", "false"}) {
      const RunLog log =
          run("deluca2008/moments-observed",
              {std::string("depth.initial=") + guess, std::string("depth.object=") + object});
      EXPECT_EQ(log.outcome, Outcome::converged) << guess << " m: " << log.reason;
    }
  }
}

TEST(MomentServo, puts_up_with_a_small_constant_depth_but_not_with_a_large_one) {
  for (const char* guess : {"0.9", "3"}) {
    EXPECT_EQ(run("deluca2008/moments-constant", {std::string("depth.initial=") + guess}).outcome,
              Outcome::converged);
  }
  for (const char* guess : {"8", "16"}) {
    EXPECT_EQ(run("deluca2008/moments-constant", {std::string("depth.initial=") + guess}).outcome,
              Outcome::leftImage);
  }
}

TEST(MomentServo, underestimated_depth_needs_the_tight_clamp) {
  // Straight ahead, where driving tells little: with depths down to 0.05 m the command dies.
  const std::vector<std::string> ahead = {"robot.initial={x: -4.17, y: -0.02, theta: 0}",
                                          "depth.initial=0.9", "depth.object=false",
                                          "sensing.source=geometry"};
  EXPECT_EQ(run("deluca2008/moments-observed", ahead).outcome, Outcome::converged);
  std::vector<std::string> loose = ahead;
  loose.push_back("depth.Z_min=0.05");
  EXPECT_EQ(run("deluca2008/moments-observed", loose).outcome, Outcome::stalled);
}

TEST(MomentServo, collinear_points_are_served_with_a_facing_plane) {
  const RunLog log =
      run("deluca2008/moments-observed",
          {"target.points=[[-0.06, 0, 0], [0.01, 0, 0], [0.06, 0, 0]]", "control.tolerance=20"});
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
}

TEST(DeLuca2008Scenarios, end_as_they_say) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(DEPTHSERVO_DATA) +
                                                               "/scenarios/deluca2008")) {
    const Scenario scenario = Scenario::load(entry.path());
    if (scenario.name.rfind("points", 0) != 0 && scenario.name.rfind("moments", 0) != 0) continue;
    const RunLog log = run(scenario);
    EXPECT_EQ(log.outcome, scenario.expect->outcome) << scenario.name << ": " << log.reason;
    ++count;
  }
  EXPECT_EQ(count, 4);
}

TEST(MobileManipulatorScenario, arm_swings_as_its_profile_says_and_the_depth_is_found) {
  const test::TemporaryFolder folder;
  folder.write("arm.yaml", R"(
name: arm
duration: 4
camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 30}
target: {points: [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]],
         pose: {xyz: [2.3, 0, 0.5]}}
robot: {type: mobile-manipulator, initial: {x: 0, y: 0, theta: 0, joints: [0, 0, 0]}}
sensing: {source: geometry}
odometry: {rate: 300}
depth: {initial: 5}
control: {law: profile, profile: [{until: 4, amplitude: [0, 0, 0.1, 0.1, 0],
          omega: [0, 0, 1.2566370614359172, 2.5132741228718345, 0]}]}
)");
  const RunLog log = run(Scenario::load(folder / "arm.yaml"));
  EXPECT_EQ(log.outcome, Outcome::timeout);
  EXPECT_EQ(log.commandNames.size(), 5u);
  EXPECT_LT(computeMetrics(log).final_depth_error_max, 0.01);
  // At 2.5 s q1 has turned the most, and q2 is back at zero: the arm reaches 0.65 m.
  const double q1 = 0.1 * 2 / (0.4 * M_PI);
  EXPECT_NEAR(log.frames[75].features[0].Z_true,
              (2.3 - 0.1) * std::cos(q1) + 0.1 * std::sin(q1) - 0.65, 1e-3);
}

}  // namespace
}  // namespace depthservo
