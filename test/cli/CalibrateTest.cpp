// What a user gets from a minute of driving, from the recording to the replay with its profile.
#include <gtest/gtest.h>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

TEST(Calibrate, writes_a_profile_that_replay_takes_and_never_over_another_file) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "drive", profile = folder / "robot.yaml";
  record(data("scenarios/robots/wheeled.yaml") + " --set seed=5 --set duration=8", sequence);
  const Result learnt =
      depthservo("calibrate " + sequence + " --motion twist --prior 3 --json --out " + profile);
  ASSERT_EQ(learnt.exitCode, 0) << learnt.err;
  const auto constants = learnt.json().at("constants");
  EXPECT_TRUE(constants.at("latency").at("shown"));
  EXPECT_NEAR(constants.at("latency").at("value"), .012,
              3 * double(constants.at("latency").at("sigma")));
  EXPECT_FALSE(constants.at("scale").at("shown"));
  EXPECT_NE(learnt.err.find("--distance"), std::string::npos) << learnt.err;

  const Result replayed =
      depthservo("replay " + sequence +
                 " --motion twist --prior 3 --estimator joint --json --errors " + profile);
  ASSERT_EQ(replayed.exitCode, 0) << replayed.err;
  // What is left is the scale of this robot, which no image tells.
  EXPECT_LE(replayed.json().at("metrics").at("final_depth_error_max"), .05);

  expectRefused(depthservo("calibrate " + sequence + " --out " + profile),
                {"robot.yaml", "exists already"});
  expectRefused(depthservo("calibrate " + sequence + " --distance 3"), {"--distance", "ID:METRES"});
  expectRefused(depthservo("calibrate " + sequence + " --distance 99:2"), {"point 99"});
}

}  // namespace
}  // namespace depthservo::test
