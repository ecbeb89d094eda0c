// What a user gets from a minute of driving, from the recording to the replay with its profile.
#include <gtest/gtest.h>

#include "cli/Tool.h"
#include "depthservo/sequence/Sequence.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

TEST(Calibrate, writes_a_profile_that_replay_takes_and_never_over_another_file) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "drive", profile = folder / "robot.yaml";
  record(data("scenarios/robots/wheeled.yaml") + " --set seed=5 --set duration=15", sequence);
  const Result learnt =
      depthservo("calibrate " + sequence + " --motion twist --prior 3 --json --out " + profile);
  ASSERT_EQ(learnt.exitCode, 0) << learnt.err;
  const auto constants = learnt.json().at("constants");
  EXPECT_TRUE(constants.at("latency").at("shown"));
  EXPECT_NEAR(constants.at("latency").at("value"), .012,
              3 * double(constants.at("latency").at("sigma")));
  // The points are a target of known shape: it tells the scale, true over measured.
  double told = 0, driven = 0;
  const Sequence recorded(sequence);
  const auto& rows = recorded.odometry();
  const auto& poses = recorded.poses();
  for (std::size_t i = 1; i < rows.size(); ++i) {
    told += rows[i - 1].twist.linear.norm() * (rows[i].time_s - rows[i - 1].time_s);
  }
  for (std::size_t i = 1; i < poses.size(); ++i) {
    driven += (poses[i].wMc.translation() - poses[i - 1].wMc.translation()).norm();
  }
  EXPECT_TRUE(constants.at("scale").at("shown"));
  EXPECT_NEAR(constants.at("scale").at("value"), driven / told - 1,
              3 * double(constants.at("scale").at("sigma")));

  const Result replayed =
      depthservo("replay " + sequence +
                 " --motion twist --prior 3 --estimator joint --json --errors " + profile);
  ASSERT_EQ(replayed.exitCode, 0) << replayed.err;
  EXPECT_LE(replayed.json().at("metrics").at("final_depth_error_max"), .02);

  expectRefused(depthservo("calibrate " + sequence + " --out " + profile),
                {"robot.yaml", "exists already"});
  expectRefused(depthservo("calibrate " + sequence + " --distance 3"), {"--distance", "ID:METRES"});
  expectRefused(depthservo("calibrate " + sequence + " --distance 99:2"), {"point 99"});

  folder.write("drive/sequence.yaml", "{}");  // and without a target nothing does
  const Result blind = depthservo("calibrate " + sequence + " --motion twist --prior 3 --json");
  EXPECT_FALSE(blind.json().at("constants").at("scale").at("shown"));
  EXPECT_NE(blind.err.find("--distance"), std::string::npos) << blind.err;
}

}  // namespace
}  // namespace depthservo::test
