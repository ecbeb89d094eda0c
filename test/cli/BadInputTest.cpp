#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kScenario = data("scenarios/unicycle-4dots.yaml");

TEST(Arguments, none_names_the_subcommands) {
  expectRefused(depthservo(""), {"run", "replay", "record", "depthservo --help"});
}

TEST(Arguments, a_misspelt_subcommand_suggests_the_nearest) {
  expectRefused(depthservo("rnu " + kScenario), {"'rnu'", "'run'"});
}

TEST(Arguments, a_misspelt_option_suggests_the_nearest) {
  expectRefused(depthservo("run " + kScenario + " --jsn"), {"'--jsn'", "'--json'"});
  expectRefused(depthservo("--hlep"), {"'--hlep'", "'--help'"});
}

TEST(Arguments, a_key_of_the_scenario_is_no_option_but_has_one) {
  expectRefused(depthservo("run " + kScenario + " --estimator joint"),
                {"'--estimator'", "--set depth.estimator=joint"});
  expectRefused(depthservo("run " + kScenario + " --seed=3"), {"--set seed=3"});
  expectRefused(depthservo("record " + kScenario + " x --pixel-noise 0.4"),
                {"--set sensing.pixel_noise=0.4"});
}

TEST(Arguments, a_value_too_many_names_the_option_and_what_it_takes) {
  expectRefused(depthservo("run " + kScenario + " --set seed=1 duration=2"),
                {"'duration=2'", "--set takes KEY=VALUE", "repeat --set"});
  expectRefused(depthservo("replay somewhere --prior 3 0.1"), {"'0.1'", "--prior takes Z[:SIGMA]"});
  expectRefused(depthservo("run " + kScenario + " other.yaml"), {"'other.yaml'", "too many"});
}

TEST(Arguments, a_misspelt_word_is_told_the_nearest) {
  expectRefused(depthservo("replay " + data("sequences/mire-2") + " --observe fokal"),
                {"'fokal'", "'focal'"});
  expectRefused(depthservo("reproduce deluca"), {"'deluca'", "'deluca2008'"});
  expectRefused(depthservo("gains --law obsever --fps 30"), {"'obsever'", "'observer'"});
  expectRefused(depthservo("keys depht"), {"'depth'"});
}

TEST(Arguments, gains_for_a_moving_target_ask_how_fast_it_moves) {
  expectRefused(depthservo("gains --law observer --fps 30"), {"--kappa"});
}

TEST(Scenarios, are_found_by_the_name_they_are_shipped_under) {
  const std::string inTree = "cd " + data("..") + " && ";
  const std::string rest = " --json --set duration=0.5 --set expect=null";
  const Result byName = depthservo("run unicycle-4dots" + rest, inTree);
  ASSERT_EQ(byName.exitCode, 0) << byName.err;
  EXPECT_EQ(byName.out, depthservo("run " + kScenario + rest).out);
  EXPECT_EQ(depthservo("run deluca2008/depth" + rest, inTree).exitCode, 0);
  expectRefused(depthservo("run unicycle-4dotz", inTree), {"'unicycle-4dots'"});
  expectRefused(depthservo("compare unicycle-4dotz", inTree), {"'unicycle-4dots'"});
}

TEST(Scenarios, with_another_ending_or_another_place_of_the_word_are_guessed) {
  expectRefused(depthservo("run " + data("scenarios/unicycle-4dots.yml")),
                {"unicycle-4dots.yml", "did you mean '", "unicycle-4dots.yaml'"});
  expectRefused(depthservo("run --set seed=1 duration=2"), {"duration=2", "--set duration=2"});
}

TEST(Arguments, help_begins_with_examples) {
  const Result help = depthservo("--help");
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_LT(help.out.find("Examples:"), help.out.find("Options:"));
  for (const char* command : {"run", "replay", "record", "report"}) {
    EXPECT_EQ(depthservo(std::string(command) + " --help").exitCode, 0);
  }
}

struct Overridden {
  const char *name, *setting, *words;
};
class BadScenario : public testing::TestWithParam<Overridden> {};

TEST_P(BadScenario, is_refused_with_the_key_and_nothing_is_written) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  expectRefused(depthservo("run " + kScenario + " --json --out " + out + " --set '" +
                           GetParam().setting + "'"),
                {"unicycle-4dots.yaml", GetParam().words});
  EXPECT_TRUE(folder.isEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Keys, BadScenario,
    testing::Values(Overridden{"unknown_key", "control.gian=1", "control.gain"},
                    Overridden{"missing_section", "camera=null", "camera"},
                    Overridden{"mistyped_number", "camera.fx=wide", "camera.fx"},
                    Overridden{"rate_out_of_range", "camera.rate=-3", "camera.rate"},
                    Overridden{"guess_not_a_number", "depth.initial=.nan", "depth.initial"},
                    Overridden{"unknown_estimator", "depth.estimator=magic", "nonlinear"},
                    Overridden{"plate_behind_the_robot", "robot.initial={x: 1, y: 0, theta: 0}",
                               "robot.initial"},
                    Overridden{"plate_out_of_view_at_the_start",
                               "robot.initial={x: -3.9, y: 9, theta: 0}", "robot.initial"},
                    Overridden{"plate_out_of_view_at_the_goal",
                               "robot.goal={x: -1, y: 5, theta: 0}", "robot.goal"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(BadScenarioFile, that_is_missing_or_binary_or_a_folder_is_refused) {
  const TemporaryFolder folder;
  expectRefused(depthservo("run " + (folder / "none.yaml").string()), {"none.yaml"});
  folder.write("binary.yaml", std::string("\0\1\2\377", 4));
  expectRefused(depthservo("run " + (folder / "binary.yaml").string()), {"binary.yaml"});
  expectRefused(depthservo("run " + folder.path().string()), {folder.path().filename().string()});
}

TEST(OutFolder, that_exists_or_cannot_be_made_is_refused_before_the_run) {
  const TemporaryFolder folder;
  folder.write("keep.txt", "mine");
  expectRefused(depthservo("run " + kScenario + " --out " + folder.path().string()), {"exists"});
  EXPECT_EQ(folder.read("keep.txt"), "mine");
  expectRefused(depthservo("run " + kScenario + " --out /proc/nowhere/run"), {"/proc/nowhere"});
}

TEST(View, without_a_display_is_refused) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  expectRefused(depthservo("run " + kScenario + " --view --out " + out, "DISPLAY= "), {"display"});
  EXPECT_TRUE(folder.isEmpty());
}

TEST(Report, of_a_folder_that_is_no_run_is_refused) {
  const TemporaryFolder folder;
  expectRefused(depthservo("report " + folder.path().string()), {"run.json"});
  EXPECT_TRUE(folder.isEmpty());
}

/// A recorded sequence that each test damages.
class BadSequence : public testing::Test {
 protected:
  void SetUp() override { record(kScenario + " --set duration=0.3 --set expect=null", path()); }
  std::string path() const { return folder_ / "sequence"; }
  void replace(const std::string& file, const std::string& from, const std::string& to) const {
    std::string text = folder_.read("sequence/" + file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " in " << text;
    folder_.write("sequence/" + file, text.replace(at, from.size(), to));
  }
  std::string line(const std::string& file, int number) const {
    std::istringstream lines(folder_.read("sequence/" + file));
    std::string text;
    for (int i = 0; i < number; ++i) std::getline(lines, text);
    return text;
  }
  void expectReplayRefused(const std::vector<std::string>& words) const {
    const std::string out = folder_ / "replay";
    expectRefused(depthservo("replay " + path() + " --json --out " + out), words);
    EXPECT_FALSE(std::filesystem::exists(out));
  }
  TemporaryFolder folder_;
};

TEST_F(BadSequence, gains_for_pixels_or_half_given_are_refused_as_in_a_scenario) {
  const auto ask = [&](const std::string& gains) {
    folder_.write("sequence/sequence.yaml", "dots: [[300, 200]]\nreplay: {" + gains + "}\n");
  };
  ask("estimator: nonlinear, k: 20, k_3: 2.0e+9");
  expectReplayRefused({"sequence.yaml", "replay.k_3", "wrong unit"});
  expectRefused(depthservo("compare " + path()), {"sequence.yaml", "replay.k_3", "wrong unit"});
  ask("estimator: nonlinear, k: 20");
  expectReplayRefused({"sequence.yaml:2", "k and k_3"});
  ask("estimator: nonlinear, k_3: 8000");
  expectReplayRefused({"sequence.yaml:2", "k and k_3"});
}

TEST_F(BadSequence, nan_in_twist_csv) {
  const std::string row = line("twist.csv", 3);
  replace("twist.csv", row, row.substr(0, row.rfind(',')) + ",nan");
  expectReplayRefused({"twist.csv:3"});
}

TEST_F(BadSequence, missing_column_in_twist_csv) {
  const std::string row = line("twist.csv", 4);
  replace("twist.csv", row, row.substr(0, row.rfind(',')));
  expectReplayRefused({"twist.csv:4"});
}

TEST_F(BadSequence, time_running_backwards) {
  const std::string second = line("twist.csv", 2), third = line("twist.csv", 3);
  replace("twist.csv", second + "\n" + third, third + "\n" + second);
  expectReplayRefused({"twist.csv:3"});
}

TEST_F(BadSequence, missing_image) {
  const std::string row = line("rgb.txt", 6);
  const std::string image = row.substr(row.find(' ') + 1);
  std::filesystem::remove(path() + "/" + image);
  expectReplayRefused({image});
}

TEST_F(BadSequence, truncated_image) {
  const std::string row = line("rgb.txt", 5);
  const std::string image = row.substr(row.find(' ') + 1);
  std::filesystem::resize_file(path() + "/" + image, 100);
  expectReplayRefused({image});
}

TEST_F(BadSequence, camera_of_another_size) {
  replace("camera.yaml", "640", "320");
  expectReplayRefused({"320"});
}

TEST_F(BadSequence, no_such_folder) {
  expectRefused(depthservo("replay " + path() + "-not"), {"sequence-not"});
}

struct Option {
  const char *name, *text, *word;
};
class BadOption : public BadSequence, public testing::WithParamInterface<Option> {};

TEST_P(BadOption, is_refused) {
  expectRefused(depthservo("replay " + path() + " " + GetParam().text), {GetParam().word});
}

INSTANTIATE_TEST_SUITE_P(
    Replay, BadOption,
    testing::Values(Option{"prior_is_a_word", "--prior zero", "--prior"},
                    Option{"prior_is_negative", "--prior -1", "--prior"},
                    Option{"prior_is_nan", "--prior nan", "--prior"},
                    Option{"prior_sigma_is_zero", "--prior 1:0", "--prior"},
                    Option{"tracker_unknown", "--tracker dust", "--tracker"},
                    Option{"tracker_misspelt", "--tracker klr", "nearest is 'klt'"},
                    Option{"motion_misspelt", "--motion grountruth", "nearest is 'groundtruth'"},
                    Option{"no_tracks", "--tracker tracks", "tracks.csv"},
                    Option{"motion_unknown", "--motion imu", "--motion"},
                    Option{"motion_of_corners", "--tracker klt --motion target",
                           "--motion target needs the points of the target"},
                    Option{"pose_of_corners", "--tracker klt --estimator pose",
                           "'pose' needs the points of the target"},
                    Option{"estimator_unknown", "--estimator magic", "--estimator"},
                    Option{"pixel_noise_negative", "--pixel-noise -1", "--pixel-noise"},
                    Option{"odometry_noise_incomplete", "--odometry-noise 0.1", "--odometry-noise"},
                    Option{"update_without_baseline", "--update", "--baseline"},
                    Option{"camera_unknown", "--camera nikon", "nikon"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace depthservo::test
