#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <set>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kFourDots = data("scenarios/unicycle-4dots.yaml");

double truth(const std::string& cell) { return std::stod(cell); }

class RunFromGuess : public testing::TestWithParam<double> {};

TEST_P(RunFromGuess, converges_with_every_depth_known_to_3_percent) {
  constexpr double kTrueDepth = 3.83;
  const Result run = depthservo("run " + kFourDots + " --json --set depth.initial=" +
                                std::to_string(GetParam() * kTrueDepth));
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  EXPECT_EQ(json["outcome"], "converged");
  EXPECT_LT(json["metrics"]["final_error_px"], 1.5);
  EXPECT_EQ(json["metrics"]["all_in_image"], true);
  ASSERT_EQ(json["points"].size(), 4u);
  for (const auto& point : json["points"]) EXPECT_LT(point["relative_error"], 0.03) << point;
}

INSTANTIATE_TEST_SUITE_P(FactorsOfTheTruth, RunFromGuess, testing::Values(0.4, 0.7, 1.0, 2.0, 3.0));

TEST(Run, reports_the_known_deadlock_of_an_underestimated_depth_as_stalled) {
  const std::string scenario = data("scenarios/unicycle-deadlock.yaml");
  const Result stalled = depthservo("run " + scenario + " --json");
  EXPECT_EQ(stalled.exitCode, 0) << stalled.err;
  EXPECT_EQ(stalled.json()["outcome"], "stalled");
  EXPECT_GT(stalled.json()["metrics"]["final_error_px"], 30);

  const Result converged = depthservo("run " + scenario + " --json --set depth.initial=5");
  EXPECT_EQ(converged.json()["outcome"], "converged");
  EXPECT_EQ(converged.exitCode, 1) << "the scenario expects a stall";
}

TEST(Run, goes_on_through_a_total_occlusion) {
  const Result run = depthservo("run " + data("scenarios/unicycle-4dots-hidden.yaml") + " --json");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  EXPECT_GT(json["metrics"]["max_gap_s"], 1.9);
  for (const auto& point : json["points"]) EXPECT_LT(point["relative_error"], 0.03) << point;
}

TEST(Run, keeps_its_sigma_honest_with_noise_everywhere) {
  const Result run = depthservo("run " + data("scenarios/unicycle-4dots-noise.yaml") + " --json");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_GT(run.json()["metrics"]["coverage_2sigma"], 0.85);
}

TEST(Run, fails_cleanly_when_a_dot_leaves_the_image) {
  const Result expected = depthservo("run " + data("scenarios/unicycle-fails.yaml") + " --json");
  EXPECT_EQ(expected.exitCode, 0) << expected.err;
  EXPECT_EQ(expected.json()["outcome"], "left-image");
  const Result unexpected =
      depthservo("run " + data("scenarios/unicycle-fails.yaml") + " --json --set expect=null");
  EXPECT_EQ(unexpected.exitCode, 3);
}

TEST(Run, ends_in_a_collision_when_the_camera_comes_too_close) {
  const Result run = depthservo(
      "run " + kFourDots + " --json --set expect=null --set depth.Z_min=2 --set depth.initial=3");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_EQ(run.json()["outcome"], "collision");
}

TEST(Run, times_out_with_exit_code_0_and_with_1_when_something_else_was_expected) {
  const Result expected = depthservo("run " + kFourDots + " --json --set duration=1");
  EXPECT_EQ(expected.exitCode, 1);
  EXPECT_EQ(expected.json()["outcome"], "timeout");
  EXPECT_EQ(depthservo("run " + kFourDots + " --set duration=1 --set expect=null").exitCode, 0);
}

TEST(Run, stops_and_says_lost_when_the_dots_never_return) {
  const Result run =
      depthservo("run " + kFourDots + " --json --set expect=null --set sensing.hidden=[[0.1,30]]");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_EQ(run.json()["outcome"], "lost");
}

TEST(Run, prints_one_json_value_on_stdout_and_words_on_stderr) {
  const Result run = depthservo("run " + kFourDots + " --json --set duration=1 --set expect=null");
  EXPECT_NO_THROW(run.json());
  EXPECT_NE(run.err.find("timeout"), std::string::npos);
  const Result quiet = depthservo("run " + kFourDots + " --set duration=1 --set expect=null");
  EXPECT_EQ(quiet.out, "");
  EXPECT_EQ(quiet.err.find('\r'), std::string::npos) << "a progress bar off the terminal";
}

TEST(Run, writes_the_same_bytes_for_the_same_seed_and_others_for_another) {
  const TemporaryFolder folder;
  const std::string noisy = "run " + data("scenarios/unicycle-4dots-noise.yaml") +
                            " --set duration=2 --set expect=null --out ";
  for (const char* name : {"a", "b"})
    ASSERT_EQ(depthservo(noisy + (folder / name).string()).exitCode, 0);
  ASSERT_EQ(depthservo(noisy + (folder / "c").string() + " --set seed=2").exitCode, 0);
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "a")) {
    const std::string file = entry.path().filename();
    if (file == "timing.json") continue;
    EXPECT_EQ(folder.read("a/" + file), folder.read("b/" + file)) << file;
    ++compared;
  }
  EXPECT_GE(compared, 5);
  EXPECT_NE(folder.read("a/features.csv"), folder.read("c/features.csv"));
}

TEST(Run, writes_a_run_folder_with_one_row_per_feature_and_frame) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  const Result run =
      depthservo("run " + data("scenarios/unicycle-4dots-hidden.yaml") + " --json --out " + out);
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(run.err.find("report.html"), std::string::npos);
  for (const char* file : {"run.json", "frames.csv", "features.csv", "timing.json", "report.html",
                           "first.png", "last.png"}) {
    EXPECT_TRUE(std::filesystem::exists(out + "/" + file)) << file;
  }
  const auto features = readCsv(out + "/features.csv");
  const auto frames = readCsv(out + "/frames.csv");
  EXPECT_EQ(features.at("id").size(), 4 * frames.at("timestamp").size());
  std::set<std::string> hiddenStatus;
  for (std::size_t i = 0; i < features.at("id").size(); ++i) {
    const double Z = std::stod(features.at("Z")[i]), sigma_Z = std::stod(features.at("sigma_Z")[i]);
    ASSERT_TRUE(std::isfinite(Z) && Z > 0 && std::isfinite(sigma_Z)) << "row " << i;
    if (features.at("measured")[i] == "0") hiddenStatus.insert(features.at("status")[i]);
  }
  EXPECT_EQ(hiddenStatus, std::set<std::string>{"coasting"});
}

TEST(Run, keeps_the_dots_within_the_limits_of_the_robot) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  ASSERT_EQ(depthservo("run " + kFourDots + " --out " + out).exitCode, 0);
  const auto frames = readCsv(out + "/frames.csv");
  const auto& v = frames.at("applied_v");
  const auto& w = frames.at("applied_w");
  double before = 0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    EXPECT_LE(std::abs(truth(v[k])), 0.5 + 1e-9);
    EXPECT_LE(std::abs(truth(w[k])), 1.0 + 1e-9);
    EXPECT_LE(std::abs(truth(v[k]) - before), 1.0 / 30 + 1e-6) << "acceleration in frame " << k;
    before = truth(v[k]);
  }
}

/// By the robot's pose in frames.csv and the place of the camera on the robot.
TEST(Run, says_how_far_from_its_goal_the_camera_ended) {
  const TemporaryFolder folder;
  const Result run =
      depthservo("run " + kFourDots + " --set sensing.source=geometry --json --out " +
                 (folder / "run").string());
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto frames = readCsv(folder / "run" / "frames.csv");
  const auto camera = [](double x, double y, double theta) {
    return std::complex<double>(x, y) + std::polar(1., theta) * std::complex<double>(0.07, 0.02);
  };
  const double theta = truth(frames.at("robot_theta").back());
  const double distance = std::abs(
      camera(truth(frames.at("robot_x").back()), truth(frames.at("robot_y").back()), theta) -
      camera(-1, 0, 0));
  ASSERT_GT(distance, 0.001);
  const auto json = run.json();
  EXPECT_NEAR(json["metrics"]["final_distance_m"], distance, 1e-9);
  EXPECT_NEAR(json["metrics"]["final_angle_rad"], std::abs(theta), 1e-7);
  EXPECT_EQ(nlohmann::json::parse(folder.read("run/run.json"))["way_left"], json["way_left"]);
  EXPECT_NE(run.err.find(json["way_left"].get<std::string>()), std::string::npos) << run.err;
}

TEST(Run, knows_of_no_way_left_to_pixels_that_are_given) {
  const Result run = depthservo(
      "run " + kFourDots +
      " --set sensing.source=geometry --set duration=0.5 --set expect=null "
      "--json --set robot.goal=null "
      "--set 'control.desired=[[259.5,179.5],[379.5,179.5],[379.5,299.5],[259.5,299.5]]'");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  for (const char* figure : {"final_distance_m", "final_angle_rad"}) {
    EXPECT_TRUE(json["metrics"].at(figure).is_null());
  }
  EXPECT_TRUE(json.at("way_left").is_null());
  EXPECT_EQ(run.err.find("goal"), std::string::npos) << run.err;
}

TEST(Run, is_repeated_from_its_run_folder) {
  const TemporaryFolder folder;
  const std::string first = folder / "first", again = folder / "again";
  ASSERT_EQ(depthservo("run " + kFourDots +
                       " --set duration=1 --set expect=null --set depth.initial=3 --out " + first)
                .exitCode,
            0);
  const Result repeated = depthservo("run " + first + "/run.json --out " + again);
  ASSERT_EQ(repeated.exitCode, 0) << repeated.err;
  EXPECT_EQ(folder.read("first/features.csv"), folder.read("again/features.csv"));
  EXPECT_EQ(folder.read("first/run.json"), folder.read("again/run.json"));
}

TEST(Keys, are_printed_as_text_and_as_a_schema) {
  const Result text = depthservo("keys depth.pose");
  EXPECT_EQ(text.exitCode, 0);
  EXPECT_NE(text.out.find("depth.pose.kappa"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("depth.initial"), std::string::npos) << text.out;
  EXPECT_EQ(depthservo("keys --schema").json()["additionalProperties"], false);
}

TEST(Report, is_made_anew_from_the_files_of_a_run_folder) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  ASSERT_EQ(
      depthservo("run " + kFourDots + " --set duration=1 --set expect=null --out " + out).exitCode,
      0);
  const std::string report = folder.read("run/report.html");
  std::filesystem::remove(out + "/report.html");
  EXPECT_EQ(depthservo("report " + out).exitCode, 0);
  EXPECT_EQ(folder.read("run/report.html"), report);
}

TEST(Run, calls_the_points_of_a_tag_its_corners) {
  const Result run = depthservo(
      "run unicycle-apriltag --set depth.estimator=constant --set depth.initial=40 --set "
      "robot.initial.y=0.8 --set sensing.source=geometry --set expect=null");
  EXPECT_NE(run.err.find("left-image"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find(": corner "), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("dot"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace depthservo::test
