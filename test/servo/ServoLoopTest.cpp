#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

/// A free camera before a plate whose object frame is the world.
const char* const kFree = R"(
name: free
duration: 15
camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 30}
target: {points: [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]],
         pose: {xyz: [0, 0, 0], rpy: [0, 0, 0]}}
robot: {type: free, initial: {xyz: [0.1, 0.1, -1.2], rpy: [0.1, 0.1, 0.5]},
        goal: {xyz: [0, 0, -0.6], rpy: [0, 0, 0]}}
sensing: {source: geometry}
odometry: {rate: 300}
depth: {initial: 3}
control: {gain: 0.8, tolerance: 1}
)";

/// A robot on the floor before a plate that faces it.
std::string onFloor(const std::string& type) {
  return R"(
name: floor
duration: 25
camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 10}
target: {points: [[-0.3, -0.3, 0], [0.3, -0.3, 0], [0.3, 0.3, 0], [-0.3, 0.3, 0]], radius: 0.03,
         pose: {xyz: [0, 0, 0.5]}}
robot: {type: )" +
         type + R"(, camera_offset: [0.1, 0, 0.5],
        initial: {x: -5, y: -3, theta: 0.6}, goal: {x: -1.2, y: 0, theta: 0},
        limits: {v: 5, w: 5, dv: 1000, dw: 1000}}
sensing: {source: geometry}
odometry: {rate: 10}
depth: {initial: 3}
control: {law: task, gain: 0.7, tolerance: 1}
)";
}

class ServoLoopTest : public testing::Test {
 protected:
  RunLog run(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    folder_.write("s.yaml", text);
    return depthservo::run(Scenario::load(folder_ / "s.yaml", overrides));
  }
  test::TemporaryFolder folder_;
};

TEST_F(ServoLoopTest, every_robot_reaches_its_goal_with_exact_depths) {
  for (const std::string& text : {std::string(kFree), onFloor("pan-unicycle"), onFloor("omni")}) {
    const RunLog log = run(text);
    EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
    EXPECT_LT(computeMetrics(log).final_depth_error_max, 1e-6);
    EXPECT_EQ(log.frames.back().command.size(), static_cast<Eigen::Index>(log.commandNames.size()));
  }
}

TEST_F(ServoLoopTest, images_at_any_interval_and_lost_ones_do_not_spoil_the_depth) {
  const RunLog log =
      run(kFree, {"camera.rate=[30, 10, 60]", "camera.jitter=0.5", "camera.dropped=0.3"});
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_LT(computeMetrics(log).final_depth_error_max, 5e-3);
  double shortest = HUGE_VAL, longest = 0;
  for (std::size_t i = 1; i < log.frames.size(); ++i) {
    const double interval = log.frames[i].time_s - log.frames[i - 1].time_s;
    shortest = std::min(shortest, interval);
    longest = std::max(longest, interval);
  }
  EXPECT_NEAR(shortest, 0.5 / 60, 2e-3);
  EXPECT_GT(longest, 1.1 / 10);
}

TEST_F(ServoLoopTest, a_profile_moves_the_robot_as_it_says_whatever_the_image_shows) {
  const RunLog log = run(
      kFree,
      {"control={law: profile, profile: [{until: 2, v: [0.1, 0, 0, 0, 0, 0]}, "
       "{until: 4, amplitude: [0, 0, 0.1, 0, 0, 0], omega: [0, 0, 3.141592653589793, 0, 0, 0]}]}",
       "robot.goal=null", "robot.initial={xyz: [-0.1, 0, -1.2], rpy: [0, 0, 0]}", "duration=4"});
  ASSERT_EQ(log.outcome, Outcome::timeout) << log.reason;
  const auto at = [&](double time_s) {
    return log.frames[static_cast<std::size_t>(std::lround(30 * time_s))];
  };
  EXPECT_NEAR(at(2).robotPose.x(), 0.1, 1e-9);
  // Integral of 0.1 sin(pi t) over 2..3 s; after 4 s the swing is back.
  EXPECT_NEAR(at(2).features[0].Z_true - at(3).features[0].Z_true, 0.2 / M_PI, 1e-6);
  EXPECT_NEAR(at(4).features[0].Z_true, 1.2, 1e-6);
}

TEST_F(ServoLoopTest, a_moving_target_moves_as_its_twist_says) {
  const RunLog log =
      run(kFree, {"target.twist=[{until: 1, v: [0, 0, 0.2, 0, 0, 0]}]",
                  "robot.initial={xyz: [0, 0, -1.2], rpy: [0, 0, 0]}", "robot.goal=null",
                  "control={law: profile, profile: [{until: 9}]}", "duration=3"});
  EXPECT_NEAR(log.frames.front().features[0].Z_true, 1.2, 1e-12);
  EXPECT_NEAR(log.frames[15].features[0].Z_true, 1.3, 1e-6);
  EXPECT_NEAR(log.frames.back().features[0].Z_true, 1.4, 1e-6);
}

/// Commands that come late make the camera swing about its goal, about once in two seconds: the
/// mean positions over 2 s are soon right, the camera is not.
TEST_F(ServoLoopTest, a_swing_is_not_convergence) {
  const RunLog log = run(kFree, {"control.gain=3", "robot.dead_time=0.45", "duration=60"});
  ASSERT_EQ(log.outcome, Outcome::converged) << log.reason;
  const auto worstUntil = [&](double time_s) {
    double worst_px = 0;
    for (const FrameRecord& frame : log.frames) {
      if (frame.time_s <= time_s && frame.time_s > time_s - 0.5) {
        worst_px = std::max(worst_px, frame.error_px);
      }
    }
    return worst_px;
  };
  const auto isMeanSmall = [&](const FrameRecord& frame) {
    return frame.time_s > 2 && meanImageError(log, frame.time_s - 2, frame.time_s) < 1;
  };
  const auto early = std::find_if(log.frames.begin(), log.frames.end(), isMeanSmall);
  ASSERT_NE(early, log.frames.end());
  EXPECT_GT(worstUntil(early->time_s), 4);
  EXPECT_LT(worstUntil(log.frames.back().time_s), 2);
}

}  // namespace
}  // namespace depthservo
