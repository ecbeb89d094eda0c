#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "support/TemporaryFolder.h"
#include "support/predictionError.h"

namespace depthservo {
namespace {

std::string data(const std::string& file) { return std::string(DEPTHSERVO_DATA) + "/" + file; }

Scenario unicycle(const std::vector<std::string>& overrides) {
  return Scenario::load(data("scenarios/unicycle-4dots.yaml"), overrides);
}

bool hasEvent(const RunLog& log, const std::string& words) {
  return std::any_of(log.events.begin(), log.events.end(), [&](const Event& event) {
    return event.what.find(words) != std::string::npos;
  });
}

class EveryEstimator : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Estimators, EveryEstimator,
                         testing::Values("filter", "joint", "window", "nonlinear"));

/// Frame from which on the depths are known: before, what is learnt of them shows in the command.
constexpr std::size_t kKnown = 75;

/// Every other half second the upper dots are hidden, in between the lower ones.
std::string halvesInTurn() {
  std::string hidden = "sensing.hidden=[";
  for (int k = 0; k < 60; ++k) {
    hidden += (k > 0 ? ", {from: " : "{from: ") + std::to_string(0.1 + 0.5 * k) +
              ", to: " + std::to_string(0.1 + 0.5 * (k + 1)) +
              (k % 2 == 0 ? ", points: [0, 1]}" : ", points: [2, 3]}");
  }
  return hidden + "]";
}

/// What a robot can do of a command.
Velocities withinSpeedLimits(const Velocities& command, const Scenario& scenario) {
  const double excess = std::max({1.0, std::abs(command[0]) / scenario.robot.limits.v,
                                  std::abs(command[1]) / scenario.robot.limits.w});
  return command / excess;
}

TEST_P(EveryEstimator, half_of_the_points_hidden_in_turn_gives_no_step_in_the_command) {
  const Scenario scenario =
      unicycle({halvesInTurn(), std::string("depth.estimator=") + GetParam(), "depth.initial=3",
                "sensing.source=geometry", "sensing.pixel_noise=0.05"});
  const RunLog log = run(scenario);
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  const double period_s = 1 / scenario.camera.rate.front();
  for (std::size_t k = kKnown; k < log.frames.size(); ++k) {
    const Velocities step = withinSpeedLimits(log.frames[k].command, scenario) -
                            withinSpeedLimits(log.frames[k - 1].command, scenario);
    ASSERT_LE(std::abs(step[0]), scenario.robot.limits.dv * period_s) << log.frames[k].time_s;
    ASSERT_LE(std::abs(step[1]), scenario.robot.limits.dw * period_s) << log.frames[k].time_s;
  }
}

TEST_P(EveryEstimator, all_points_hidden_for_two_seconds_are_found_again_and_the_task_done) {
  const RunLog log = run(unicycle({"sensing.hidden=[[4, 6]]", "depth.initial=3",
                                   std::string("depth.estimator=") + GetParam()}));
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_LT(test::predictionError_px(log), 5);
}

TEST(HiddenSigma, stops_the_robot_smoothly_and_lets_it_go_on_when_the_dots_return) {
  const Scenario scenario =
      unicycle({"sensing.hidden=[[3, 8]]", "control.hidden_sigma=0.3", "sensing.source=geometry"});
  const RunLog log = run(scenario);
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_TRUE(hasEvent(log, "slows down"));
  EXPECT_TRUE(hasEvent(log, "waits"));
  EXPECT_TRUE(hasEvent(log, "full speed"));
  bool stood = false;
  for (std::size_t k = kKnown; k < log.frames.size(); ++k) {
    const FrameRecord& frame = log.frames[k];
    stood = stood || (frame.command.isZero() && frame.applied.norm() < 1e-3);
    // At most 0.5 s from full speed to a stop and back.
    const double step = withinSpeedLimits(frame.command, scenario)[0] -
                        withinSpeedLimits(log.frames[k - 1].command, scenario)[0];
    EXPECT_LE(std::abs(step), scenario.robot.limits.v / 0.5 / 30 + 0.01) << frame.time_s;
  }
  EXPECT_TRUE(stood);
}

TEST(HiddenSigma, ends_the_run_as_lost_after_waiting_in_vain) {
  const RunLog log = run(unicycle({"sensing.hidden=[[3, 30]]", "control.hidden_sigma=0.3",
                                   "control.hidden_wait=3", "sensing.source=geometry"}));
  EXPECT_EQ(log.outcome, Outcome::lost) << log.reason;
  EXPECT_LT(log.frames.back().time_s, 12);
}

TEST(HiddenSigma, nothing_seen_is_no_success) {
  const RunLog log = run(unicycle({"sensing.hidden=[[3, 30]]", "control.hidden_sigma=1000",
                                   "sensing.source=geometry", "duration=20"}));
  EXPECT_EQ(log.outcome, Outcome::timeout) << log.reason;
  EXPECT_LT(computeMetrics(log).final_error_px, 1.5) << "it is there, but has not seen it";
}

/// A free camera before a plate that turns aside and back.
class LookingAside : public testing::Test {
 protected:
  RunLog run(double away_s) const {
    const std::string turn = std::to_string(1 + away_s), end = std::to_string(2 + away_s);
    folder_.write("s.yaml", R"(
name: aside
duration: )" + end + R"(
camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 30}
target: {points: [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]],
         pose: {xyz: [0, 0, 0], rpy: [0, 0, 0]}}
robot: {type: free, initial: {xyz: [-0.3, 0, -1.2], rpy: [0, 0, 0]}, limits: {v: 5, w: 5}}
sensing: {source: image, pixel_noise: 0.1}
odometry: {rate: 30}
depth: {initial: 3}
control: {law: profile, profile: [{until: 0.8, v: [0.3, 0, 0.1, 0, 0, 0]},
          {until: 1, v: [0, 0, 0, 0, 4, 0]}, {until: )" +
                                turn + R"(},
          {until: )" + std::to_string(1.2 + away_s) +
                                R"(, v: [0, 0, 0, 0, -4, 0]}, {until: 60}]}
)");
    return depthservo::run(Scenario::load(folder_ / "s.yaml"));
  }
  test::TemporaryFolder folder_;
};

TEST_F(LookingAside, dots_that_leave_the_image_and_come_back_are_the_same_dots) {
  const RunLog log = run(1.5);
  ASSERT_EQ(log.outcome, Outcome::timeout) << log.reason;
  EXPECT_FALSE(computeMetrics(log).all_in_image);
  EXPECT_TRUE(hasEvent(log, "dot 0 hidden"));
  for (const FeatureRecord& feature : log.frames.back().features) {
    EXPECT_TRUE(feature.measured) << "dot " << feature.id;
    EXPECT_LT(feature.estimate.sigma_Z(), 0.1 * feature.Z_true) << "dot " << feature.id;
    EXPECT_NEAR(feature.estimate.Z(), feature.Z_true, 0.05 * feature.Z_true);
    EXPECT_NEAR(feature.u, feature.u_true, 2);
  }
}

TEST_F(LookingAside, dots_that_stay_out_of_the_image_end_the_run) {
  const RunLog log = run(4);
  EXPECT_EQ(log.outcome, Outcome::leftImage) << log.reason;
  EXPECT_LT(log.frames.back().time_s, 3.5);
}

}  // namespace
}  // namespace depthservo
