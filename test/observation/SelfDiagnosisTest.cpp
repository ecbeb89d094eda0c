// Runs that judge their own sensors, along scenarios in which all six degrees of freedom move.
#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;
const std::string kGeneral = DEPTHSERVO_DATA "/scenarios/free-general.yaml";
const std::string kApproach = DEPTHSERVO_DATA "/scenarios/free-approach.yaml";

RunLog run(const std::string& file, const std::vector<std::string>& overrides) {
  return run(Scenario::load(file, overrides));
}

std::string seeded(unsigned seed) { return "seed=" + std::to_string(seed); }

TEST(SelfDiagnosis, says_nothing_in_a_hundred_clean_runs) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const RunLog log = run(kGeneral, {seeded(seed), "duration=4"});
    EXPECT_FALSE(log.diagnosis->isFault()) << log.diagnosis->message() << ", seed " << seed;
    EXPECT_EQ(log.diagnosis->varianceFactor, 1);
    EXPECT_TRUE(log.events.empty());
  }
}

TEST(SelfDiagnosis, says_nothing_where_the_motion_hardly_shows_the_focal_length) {
  for (unsigned seed = 1; seed <= 25; ++seed) {
    const RunLog log =
        run(kApproach, {seeded(seed), "control.excite=null", "depth.estimator=true"});
    EXPECT_FALSE(log.diagnosis->isFault()) << log.diagnosis->message() << ", seed " << seed;
  }
}

TEST(SelfDiagnosis, names_images_that_are_a_frame_late_within_three_seconds) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const RunLog log = run(kGeneral, {seeded(seed), "duration=4", "sensing.latency=0.0333333333"});
    EXPECT_EQ(log.diagnosis->latest.cause, Cause::latency) << log.diagnosis->message();
    EXPECT_NEAR(log.diagnosis->latest.size, 1. / 30, .01);
    EXPECT_LT(log.diagnosis->first_s, 3);
    ASSERT_FALSE(log.events.empty());
    EXPECT_EQ(log.events.front().time_s, log.diagnosis->first_s);
    EXPECT_EQ(log.events.front().what.rfind("latency", 0), 0u) << log.events.front().what;
  }
}

TEST(SelfDiagnosis, inflates_sigma_while_the_images_contradict_the_odometry) {
  const std::vector<std::string> biased = {"odometry.gyro_bias=[0, 0.02, 0]"};
  const RunLog log = run(kGeneral, biased);
  EXPECT_GT(log.diagnosis->varianceFactor, 10);
  EXPECT_GT(computeMetrics(log).coverage_2sigma, .8) << "without it .2";
}

TEST(SelfDiagnosis, leaves_the_joint_filter_alone_with_what_it_learns) {
  const std::vector<std::string> late = {"sensing.latency=0.0333333333", "depth.estimator=joint"};
  const RunLog log = run(kGeneral, late);
  EXPECT_EQ(log.diagnosis->latest.cause, Cause::latency);
  EXPECT_TRUE(log.diagnosis->isCompensated);
  ASSERT_TRUE(log.joint);
  EXPECT_TRUE(log.joint->timeOffset.isObserved);
  EXPECT_NEAR(log.joint->timeOffset.value, 1. / 30, .002);
  EXPECT_LT(computeMetrics(log).final_depth_error_max, .01);
}

TEST(SelfDiagnosis, forecasts_the_frames_that_are_still_needed) {
  const RunLog log = run(kGeneral, {"duration=3"});
  const FrameRecord& first = log.frames[3];
  ASSERT_EQ(first.features.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const double forecast = first.features[i].frames_to_5pct;
    int needed = 0;
    while (log.frames[static_cast<std::size_t>(3 + needed)].features[i].frames_to_5pct > 0) {
      ++needed;
    }
    EXPECT_GT(needed, 0);
    EXPECT_LT(needed, 3 * forecast + 3);
    EXPECT_GT(3 * needed + 3, forecast);
  }
  EXPECT_EQ(log.frames.back().features[0].frames_to_5pct, 0);
}

TEST(ServoDepth, blended_takes_the_depth_at_the_goal_while_nothing_is_known) {
  const auto first = [](const char* depth) {
    const std::string choice = std::string("control.depth=") + depth;
    const RunLog log = run(kApproach, {choice, "depth.initial=0.3", "duration=0.2",
                                       "control.excite=null", "expect=null", "control.gain=1"});
    return log.frames.front().command.head<3>().norm();
  };
  // The command is proportional to the depth that is used: 0.3 m, or nearly the goal's 1 m.
  EXPECT_NEAR(first("blended") / first("observed"), 1 / .3, .5);
}

TEST(GainInDoubt, slows_the_first_images_only) {
  const std::vector<std::string> far = {"robot.initial.xyz=[-1.5, 0.3, 0.3]", "control.excite=null",
                                        "expect=null", "duration=2", "odometry.noise=[0, 0]"};
  std::vector<std::string> careful = far;
  careful.emplace_back("control.gain_in_doubt=0.25");
  const RunLog plain = run(kApproach, far), slow = run(kApproach, careful);
  const auto speed = [](const RunLog& log, std::size_t k) { return log.frames[k].command.norm(); };
  EXPECT_NEAR(speed(slow, 0), .25 * speed(plain, 0), 1e-9);
  EXPECT_GT(speed(slow, 40), .9 * speed(plain, 40));
}

TEST(RunDiagnosis, without_a_cause_is_no_agreement_where_innovations_are_larger_than_declared) {
  RunDiagnosis diagnosis;
  diagnosis.latest.values = 400;
  for (const auto& [nis, agrees] : {std::pair(2.1, true), {1.2, true}, {2.4, true}, {4.3, false}}) {
    diagnosis.latest.meanNis = nis;
    const std::string message = diagnosis.message();
    EXPECT_EQ(message.find("agree with the declared noise") != std::string::npos, agrees)
        << message;
    EXPECT_EQ(message.find("2.1 times the declared variance") != std::string::npos, !agrees);
    EXPECT_FALSE(diagnosis.isFault());
  }
  diagnosis.latest.values = 30;  // of so few 3.4 may be chance
  diagnosis.latest.meanNis = 3.4;
  EXPECT_NE(diagnosis.message().find("agree"), std::string::npos);
}

TEST(SelfDiagnosis, names_the_range_before_a_target_that_moves) {
  for (const char* scale : {"odometry.scale=0.1", "odometry.scale=10"}) {
    const RunLog log = run(kGeneral, {scale, "depth.Z_min=0.5", "depth.Z_max=4"});
    EXPECT_NE(log.diagnosis->message().find("held at the end of the range 0.5 to 4 m"),
              std::string::npos)
        << log.diagnosis->message();
    EXPECT_EQ(log.diagnosis->message().find("the target moves"), std::string::npos);
  }
}

}  // namespace
}  // namespace depthservo
