#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

class RecordThenReplay : public testing::TestWithParam<const char*> {};

TEST_P(RecordThenReplay, gives_the_estimates_of_the_run) {
  const TemporaryFolder folder;
  const std::string run = folder / "run", sequence = folder / "sequence",
                    replay = folder / "replay";
  const std::string arguments = data("scenarios/unicycle-4dots-hidden.yaml") +
                                " --set depth.initial=3 --set duration=7 " + GetParam();
  ASSERT_EQ(depthservo("run " + arguments + " --set expect=null --out " + run).exitCode, 0);
  record(arguments + " --set expect=null", sequence);
  const Result result = depthservo("replay " + sequence + " --out " + replay);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectSameEstimates(run, replay, 1e-9);

  const std::string explicitly = folder / "explicitly";
  ASSERT_EQ(depthservo("replay " + sequence +
                       " --prior 3 --estimator nonlinear --pixel-noise 0.2 --out " + explicitly)
                .exitCode,
            0);
}

INSTANTIATE_TEST_SUITE_P(Sources, RecordThenReplay,
                         testing::Values("", "--set sensing.source=geometry",
                                         "--set odometry.rate=77 --set sensing.delay=0.05",
                                         "--set odometry.rate=77 --set odometry.rows=mean-before",
                                         "--set odometry.rate=40 --set odometry.rows=instant "
                                         "--set sensing.delay=0.05",
                                         "--set odometry.noise=[0.005,0.002]"));

TEST(Rows, mean_what_the_sequence_or_the_option_says) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") +
             " --set duration=4 --set expect=null --set odometry.rate=25 --set "
             "odometry.rows=mean-before",
         sequence);
  EXPECT_NE(folder.read("sequence/sequence.yaml").find("\nrows: mean-before\n"), std::string::npos);
  const auto error = [&](const std::string& option) {
    const Result result = depthservo("replay " + sequence + " --json " + option);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result.json()["metrics"]["final_depth_error_max"].get<double>();
  };
  EXPECT_EQ(error(""), error("--rows mean-before"));
  EXPECT_GT(error("--rows hold"), 2 * error(""));  // a row late
  const Result wrong = depthservo("replay " + sequence + " --rows mean-befor");
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_NE(wrong.err.find("the nearest is 'mean-before'"), std::string::npos) << wrong.err;
}

TEST(AprilTags, a_recorded_run_before_a_tag_replays_exactly_and_names_its_size) {
  const TemporaryFolder folder;
  const std::string run = folder / "run", sequence = folder / "sequence", again = folder / "again";
  const std::string arguments =
      data("scenarios/unicycle-apriltag.yaml") + " --set duration=3 --set expect=null ";
  ASSERT_EQ(depthservo("run " + arguments + "--out " + run).exitCode, 0);
  record(arguments, sequence);
  const Result result = depthservo("replay " + sequence + " --out " + again);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(folder.read("run/features.csv"), folder.read("again/features.csv"));
  EXPECT_NE(result.err.find("tag 7: observed size 0.2"), std::string::npos) << result.err;

  const Result natural = depthservo("replay " + sequence + " --tracker klt --corners 30 --json");
  ASSERT_EQ(natural.exitCode, 0) << natural.err;
  EXPECT_GE(natural.json()["points"].size(), 10u);
  EXPECT_TRUE(natural.json()["metrics"].contains("rejected_points"));
}

TEST(AprilTags, a_wrong_size_is_told_on_stderr_and_in_the_result) {
  const Result result = depthservo("run " + data("scenarios/unicycle-apriltag.yaml") +
                                   " --set duration=3 --set expect=null --json --set "
                                   "'target.tags=[{id: 7, size: 0.2, assumed_size: 0.22}]'");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("warning: "), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("check the size"), std::string::npos);
  EXPECT_TRUE(result.json()["tags"][0]["disagrees"].get<bool>());
}

TEST(Trackers, that_need_images_are_refused_without_them) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set duration=1 --set sensing.source=geometry",
         sequence);
  for (const char* tracker : {"klt", "apriltag"}) {
    const Result result = depthservo("replay " + sequence + " --tracker " + tracker);
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_NE(result.err.find("needs images"), std::string::npos) << result.err;
  }
  const Result result = depthservo("replay " + sequence + " --tracker apriltag --tag-family 36h12");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.err.find("36h11"), std::string::npos) << result.err;
}

TEST(Record, refuses_an_existing_folder_and_leaves_it_alone) {
  const TemporaryFolder folder;
  const Result result =
      depthservo("record " + data("scenarios/unicycle-4dots.yaml") + " " + folder.path().string());
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(folder.isEmpty());
}

class RealImages : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/share/visp-images-data/ViSP-images/mire-2")) {
      GTEST_SKIP() << "ViSP's images are not installed (Debian: visp-images-data)";
    }
  }
};

TEST_P(RealImages, four_dots_are_tracked_and_their_depths_agree_with_the_pose_of_the_plate) {
  const Result result = depthservo("replay " + data("sequences/mire-2") +
                                   " --tracker dots --motion target --json --prior " + GetParam());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_EQ(json["metrics"]["frames"], 501);
  ASSERT_EQ(json["points"].size(), 4u);
  for (const auto& point : json["points"]) {
    EXPECT_EQ(point["measured_frames"], 501) << point;
    EXPECT_LT(point["relative_error"], 0.03) << point;
  }
}

class RealImagesFromBadGuess : public RealImages {};

TEST_P(RealImagesFromBadGuess, every_depth_is_within_a_percent_of_the_plate_after_15_frames) {
  const TemporaryFolder folder;
  const std::string out = folder / "replay";
  const Result result =
      depthservo("replay " + data("sequences/mire-2") + " --tracker dots --motion target --prior " +
                 GetParam() + " --out " + out);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto features = readCsv(out + "/features.csv");
  const auto &Z = features.at("Z"), &truth = features.at("Z_true");
  ASSERT_EQ(Z.size(), 4u * 501);
  for (std::size_t row = 4 * 15; row < Z.size(); ++row) {
    ASSERT_LT(std::abs(std::stod(Z[row]) / std::stod(truth[row]) - 1), .01) << "frame " << row / 4;
  }
}

// 0.25 and 4 times the plate's distance in the first image, 0.63 m.
INSTANTIATE_TEST_SUITE_P(Guesses, RealImagesFromBadGuess, testing::Values("0.157", "2.5"));

INSTANTIATE_TEST_SUITE_P(Guesses, RealImages, testing::Values("0.4", "1.5", "3"));

class WithBaseline : public testing::Test {
 protected:
  void SetUp() override {
    record(
        data("scenarios/unicycle-4dots.yaml") + " --set sensing.source=geometry --set duration=3",
        sequence_);
  }
  TemporaryFolder folder_;
  std::string sequence_ = folder_ / "sequence", baseline_ = folder_ / "baseline.json";
};

TEST_F(WithBaseline, exits_with_1_when_a_figure_moves_and_accepts_it_with_update) {
  const std::string replay = "replay " + sequence_ + " --baseline " + baseline_;
  EXPECT_EQ(depthservo(replay).exitCode, 2) << "there is no baseline yet";
  EXPECT_EQ(depthservo(replay + " --update").exitCode, 0);
  EXPECT_EQ(depthservo(replay).exitCode, 0);
  const Result moved = depthservo(replay + " --prior 2");
  EXPECT_EQ(moved.exitCode, 1);
  EXPECT_NE(moved.err.find("moved: point 0, Z at 10 %"), std::string::npos) << moved.err;
  EXPECT_EQ(depthservo(replay + " --prior 2 --update").exitCode, 0);
  EXPECT_EQ(depthservo(replay + " --prior 2").exitCode, 0);
}

TEST_F(WithBaseline, refuses_a_file_that_is_no_baseline) {
  folder_.write("baseline.json", "{\"figures\": 3}");
  const Result result = depthservo("replay " + sequence_ + " --baseline " + baseline_);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.err.find("baseline.json"), std::string::npos);
}

TEST_F(WithBaseline, motion_from_poses_gives_the_same_depths_as_from_twists) {
  const auto depths = [&](const std::string& motion) {
    return depthservo("replay " + sequence_ + " --json --motion " + motion).json()["points"];
  };
  const auto twist = depths("twist"), poses = depths("groundtruth");
  for (std::size_t i = 0; i < twist.size(); ++i) {
    const double Z = twist[i]["Z"];
    EXPECT_NEAR(poses[i]["Z"], Z, 1e-6 * Z);
  }
}

}  // namespace
}  // namespace depthservo::test
