#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kUnicycle = data("scenarios/deluca2008/focal-unicycle.yaml");
const std::string kTurning = data("scenarios/deluca2008/focal.yaml");

nlohmann::json readJson(const std::string& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

class ObserveFocal : public testing::Test {
 protected:
  Result observe(const std::string& arguments) const {
    return depthservo("replay " + sequence_ + " --observe focal " + arguments);
  }
  TemporaryFolder folder_;
  std::string sequence_ = folder_ / "sequence";
};

TEST_F(ObserveFocal, finds_the_focal_length_of_a_turning_camera_with_gains_of_its_own) {
  record(kTurning + " --set sensing.pixel_noise=0.1", sequence_);
  const Result result = observe("--pixel-noise 0.1 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_NEAR(json["focal"], 128, 3);
  EXPECT_NEAR(json["focal"], 128, 4 * json["sigma_focal"].get<double>());
  EXPECT_NE(json["status"], "unexcited");
  EXPECT_EQ(json["camera_focal"], 128);
  const auto point = json["points"][0];
  EXPECT_EQ(point["measured_frames"], 151);
  EXPECT_TRUE(point["eta1"].is_number() && point["eta2"].is_number());
  EXPECT_GT(point["sigma_min"], 0);
}

TEST_F(ObserveFocal,
       sees_the_lever_arm_of_the_unicycle_and_compensates_it_when_the_depth_is_known) {
  record(kUnicycle, sequence_);
  const std::string gains = "--focal-gains 30,1500,0.01 --json";
  const auto biased = observe(gains).json();
  EXPECT_NEAR(biased["focal"], 1096 * (1 + 0.07 / 2), 1);
  EXPECT_NEAR(biased["lever"], 0.07, 1e-6);
  EXPECT_TRUE(biased["compensated_focal"].is_null());
  const auto compensated = observe(gains + " --prior 2").json();
  EXPECT_NEAR(compensated["compensated_focal"], 1096, 1);
}

TEST_F(ObserveFocal, does_not_use_the_focal_length_of_the_camera_file) {
  record(kTurning, sequence_);
  const auto right = observe("--json").json();
  const std::string file = folder_ / "wrong.yaml";
  folder_.write("wrong.yaml",
                "{image_width: 320, image_height: 240, camera_matrix: {rows: 3, cols: 3, data: "
                "[200, 0, 159.5, 0, 200, 119.5, 0, 0, 1]}}");
  const auto wrong = observe("--json --camera " + file).json();
  EXPECT_EQ(wrong["camera_focal"], 200);
  EXPECT_NEAR(wrong["focal"], right["focal"], 1e-9);
}

TEST_F(ObserveFocal, writes_a_folder_with_a_table_a_plot_and_a_report) {
  record(kTurning, sequence_);
  const std::string out = folder_ / "out";
  ASSERT_EQ(observe("--out " + out).exitCode, 0);
  const auto table = readCsv(out + "/focal.csv");
  EXPECT_EQ(table.at("timestamp").size(), 151u);
  EXPECT_NEAR(std::stod(table.at("focal").back()), 128, 3);
  for (const char* column :
       {"id", "measured", "sigma_focal", "inverse_focal", "eta1", "eta2", "sigma_min", "status"}) {
    EXPECT_EQ(table.at(column).size(), 151u) << column;
  }
  for (const char* file : {"run.json", "report.html"}) {
    EXPECT_TRUE(std::filesystem::exists(out + "/" + file)) << file;
  }
  EXPECT_EQ(observe("--out " + out).exitCode, 2) << "must not exist";
}

struct Refusal {
  const char *name, *profile, *because;
};

class FocalRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(FocalRefusal, says_why_in_words) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(kTurning + " --set control.profile='[{until: 5, v: " + GetParam().profile + "}]'",
         sequence);
  const Result result = depthservo("replay " + sequence + " --observe focal --json");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.err.find(GetParam().because), std::string::npos) << result.err;
  EXPECT_TRUE(result.out.empty());
}

INSTANTIATE_TEST_SUITE_P(Motions, FocalRefusal,
                         testing::Values(Refusal{"rest", "[0, 0, 0, 0, 0, 0]", "no motion"},
                                         Refusal{"translation", "[0.02, 0.01, 0, 0, 0, 0]",
                                                 "no rotation"},
                                         Refusal{"roll", "[0, 0, 0, 0, 0, 0.3]",
                                                 "rotation about the optical axis only"}),
                         [](const auto& test) { return test.param.name; });

TEST_F(ObserveFocal, refuses_what_it_cannot_use) {
  record(kTurning, sequence_);
  for (const char* arguments :
       {"--motion target", "--baseline x.json", "--focal-gains 1,2", "--focal-gains 1,2,-3"}) {
    const Result result = observe(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_TRUE(result.out.empty()) << arguments;
  }
  EXPECT_EQ(depthservo("replay " + sequence_ + " --focal-gains 1,2,3").exitCode, 2);
  EXPECT_EQ(depthservo("replay " + sequence_ + " --observe distortion").exitCode, 2);
}

// ---- why a depth is not learnt ----

class UnexcitedDepth : public testing::TestWithParam<Refusal> {};

TEST_P(UnexcitedDepth, is_explained_in_json_in_the_log_and_on_the_terminal) {
  const TemporaryFolder folder;
  const std::string out = folder / "out", replayedOut = folder / "replayed";
  const Result result = depthservo("run " + data("scenarios/deluca2008/depth.yaml") +
                                   " --set control.profile='[{until: 4, v: " + GetParam().profile +
                                   "}]' --json --out " + out);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto point = result.json()["points"][0];
  EXPECT_EQ(point["status"], "unexcited");
  EXPECT_EQ(point["unexcited_because"], GetParam().because);
  EXPECT_GT(point["unexcited_s"], 3);
  const std::string sequence = folder / "sequence";
  record(data("scenarios/deluca2008/depth.yaml") +
             " --set control.profile='[{until: 4, v: " + GetParam().profile + "}]'",
         sequence);
  const Result replayed = depthservo("replay " + sequence + " --out " + replayedOut);
  EXPECT_NE(replayed.err.find(GetParam().because), std::string::npos) << replayed.err;
  for (const std::string& run : std::vector<std::string>{out, replayedOut}) {
    const auto events = readJson(run + "/run.json")["events"];
    ASSERT_FALSE(events.empty()) << run;
    EXPECT_EQ(events.back()["what"],
              std::string("unexcited: ") + GetParam().because + " (point 0)");
  }
}

INSTANTIATE_TEST_SUITE_P(
    Motions, UnexcitedDepth,
    testing::Values(Refusal{"rest", "[0, 0, 0, 0, 0, 0]", "no motion"},
                    Refusal{"rotation", "[0, 0, 0, 0.1, 0.1, 0.5]", "no translation"},
                    Refusal{"along_the_ray", "[0.00390625, -0.00390625, 0.05, 0, 0, 0]",
                            "moving along the line of sight of point 0"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace depthservo::test
