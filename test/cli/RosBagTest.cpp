#include <gtest/gtest.h>

#include "Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::expectRefused;
using test::Result;

const std::string kBags = std::string(DEPTHSERVO_BAGS) + "/";
const std::string kTarget = " --target " + kBags + "drive/sequence.yaml";

TEST(RosBagTest, a_replay_gives_the_estimates_of_our_own_layout) {
  test::TemporaryFolder folder;
  const std::string own = (folder / "own").string();
  ASSERT_EQ(test::depthservo("replay " + kBags + "drive --out " + own).exitCode, 0);
  for (const std::string bag : {"lz4.bag", "zstd.mcap", "big.db3"}) {
    const std::string out = (folder / bag).string();
    const Result result = test::depthservo("replay " + kBags + bag + kTarget + " --out " + out);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    test::expectSameEstimates(out, own, 1e-9);
  }
}

TEST(RosBagTest, the_camera_in_the_base_may_be_given_instead_of_transforms) {
  test::TemporaryFolder folder;
  const std::string own = (folder / "own").string(), out = (folder / "out").string();
  ASSERT_EQ(test::depthservo("replay " + kBags + "drive --out " + own).exitCode, 0);
  // drive.py: MOUNT times OPTICAL; roll, pitch, yaw of their product.
  const Result result = test::depthservo(
      "replay " + kBags + "zstd.mcap" + kTarget + " --out " + out +
      " --camera-in-base 0.31346840645914104,-0.05547445978581915,0.2214067118114253,"
      "-1.922412653401352,0.09391879877564321,-1.8051873009305899");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  test::expectSameEstimates(out, own, 1e-9);
}

TEST(RosBagTest, info_tells_what_it_has_and_what_is_missing) {
  const Result text = test::depthservo("info " + kBags + "lz4.bag");
  EXPECT_EQ(text.exitCode, 0) << text.err;
  for (const char* words :
       {"/odom (nav_msgs/Odometry): 80, 50 Hz", "<- odometry", "0.004 s later",
        "frame camera_link in base_link", "left, right", "it can be replayed"}) {
    EXPECT_NE(text.out.find(words), std::string::npos) << words << "\n" << text.out;
  }
  EXPECT_EQ(text.out.find(" -0 "), std::string::npos) << text.out;
  const auto json = test::depthservo("info " + kBags + "zstd.mcap --json").json();
  EXPECT_EQ(json["replayable"], true);
  EXPECT_EQ(json["topics"].size(), 4u);
  const auto none =
      test::depthservo("info " + kBags + "zstd.mcap --topics odometry=none --json").json();
  EXPECT_EQ(none["replayable"], false);
  EXPECT_NE(none["missing"].get<std::string>().find("motion"), std::string::npos);
  const auto folder = test::depthservo("info " + kBags + "drive --json").json();
  EXPECT_EQ(folder["replayable"], true);
  EXPECT_EQ(folder["topics"][0]["messages"], 20);
}

TEST(RosBagTest, other_commands_take_bags_and_wrong_words_are_refused_in_one_line) {
  const Result comparison = test::depthservo("compare " + kBags + "lz4.mcap" + kTarget +
                                             " --estimators filter,constant --json");
  EXPECT_EQ(comparison.exitCode, 0) << comparison.err;
  const std::string replay = "replay " + kBags;
  expectRefused(test::depthservo(replay + "lz4.bag --topics image=/imu"),
                {"/imu", "sensor_msgs/Imu"});
  expectRefused(test::depthservo(replay + "lz4.bag --topics odometry=/odom@nowhere"),
                {"nowhere", "camera_optical", "--camera-in-base"});
  expectRefused(test::depthservo(replay + "drive --topics image=/a"), {"--topics", "folder"});
  expectRefused(test::depthservo(replay + "nothing.bag"), {"no such folder or bag"});
}

TEST(RosBagTest, what_takes_no_recording_points_to_replay) {
  for (const char* bag : {"lz4.bag", "zstd.mcap", "little.db3"}) {
    const std::string source = " --source " + kBags + bag + " --camera tum-fr1 ";
    expectRefused(test::depthservo("live --no-window --twist /dev/null" + source), {bag, "replay"});
    expectRefused(test::depthservo("teach --out nowhere" + source), {bag, "replay"});
  }
}

}  // namespace
}  // namespace depthservo
