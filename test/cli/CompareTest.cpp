#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kQuick = data("scenarios/unicycle-4dots.yaml") +
                           " --set sensing.source=geometry --set expect=null --set duration=8";

nlohmann::json estimatorNamed(const nlohmann::json& comparison, const std::string& name) {
  for (const auto& one : comparison["estimators"]) {
    if (one["estimator"] == name) return one;
  }
  return {};
}

TEST(Compare, gives_every_estimator_the_same_measurements_and_shows_the_limit) {
  const Result result = depthservo("compare " + kQuick + " --json --times 2,5");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_EQ(json["truth"], true);
  ASSERT_EQ(json["times"].size(), 3u);  // and the end
  EXPECT_NEAR(json["times"][0], 2, 1e-6);
  std::set<std::string> names;
  for (const auto& one : json["estimators"]) names.insert(one["estimator"]);
  for (const char* name : {"constant", "two-frame", "nonlinear", "window", "filter", "joint"}) {
    EXPECT_TRUE(names.count(name)) << name;
  }
  const double limit = json["limits"][0]["relative_sigma"][1];
  EXPECT_EQ(json["limits"][0]["limit"], "limit");
  EXPECT_GT(limit, 0);
  EXPECT_LT(limit, 0.01);
  const auto filter = estimatorNamed(json, "filter"), constant = estimatorNamed(json, "constant");
  EXPECT_LT(filter["relative_error"][1], 4 * limit);
  EXPECT_NEAR(filter["relative_sigma"][1], limit, 0.3 * limit);
  EXPECT_LT(filter["frames_to_5pct"], 90);
  EXPECT_GT(filter["coverage_2sigma"], 0.8);
  EXPECT_GT(constant["relative_error"][1], 0.5);
  EXPECT_TRUE(constant["frames_to_5pct"].is_null()) << "never";
  EXPECT_EQ(result.out.find("per_image"), std::string::npos) << "times of computation differ";
  EXPECT_NE(result.err.find("cost per image"), std::string::npos);
}

TEST(Compare, of_the_estimator_of_the_run_shows_the_errors_of_the_run) {
  const auto run = depthservo("run " + kQuick + " --json").json();
  const auto comparison = depthservo("compare " + kQuick + " --json --estimators filter").json();
  double squares = 0;
  for (const auto& point : run["points"]) {
    squares += std::pow(point["relative_error"].get<double>(), 2) / 4;
  }
  const double last = estimatorNamed(comparison, "filter")["relative_error"].back();
  EXPECT_NEAR(last, std::sqrt(squares), 1e-9);
}

TEST(Compare, of_a_recorded_sequence_is_that_of_its_scenario) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(kQuick, sequence);
  const std::string rest = " --json --estimators nonlinear,filter,joint --times 3";
  const auto live = depthservo("compare " + kQuick + rest).json();
  const auto recorded = depthservo("compare " + sequence + rest).json();
  for (const char* name : {"nonlinear", "filter", "joint"}) {
    const double a = estimatorNamed(live, name)["relative_error"].back();
    const double b = estimatorNamed(recorded, name)["relative_error"].back();
    EXPECT_NEAR(a, b, 1e-6) << name;
  }
  const double limit = live["limits"][0]["relative_sigma"][0];
  EXPECT_NEAR(recorded["limits"][0]["relative_sigma"][0], limit, 0.02 * limit)
      << "the recorded points start where they were measured";
}

TEST(Compare, observes_a_sequence_as_replay_does_with_the_same_options) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set expect=null --set duration=1", sequence);
  for (const std::string options :
       {"--motion groundtruth --prior 5:1 --pixel-noise 0.4", "--motion target --tracker dots",
        "--odometry-noise 0.01,0.002 --odometry-scale-sigma 0.05 --focal-sigma 0.02"}) {
    SCOPED_TRACE(options);
    const Result replay = depthservo("replay " + sequence + " --json " + options);
    const Result comparison =
        depthservo("compare " + sequence + " --json --estimators filter " + options);
    ASSERT_EQ(replay.exitCode, 0) << replay.err;
    ASSERT_EQ(comparison.exitCode, 0) << comparison.err;
    const auto points = replay.json()["points"];
    double errors = 0, sigmas = 0;
    for (const auto& point : points) {
      errors += std::pow(point["relative_error"].get<double>(), 2) / 4;
      sigmas += std::pow(point["sigma_Z"].get<double>() / point["Z"].get<double>(), 2) / 4;
    }
    const auto filter = estimatorNamed(comparison.json(), "filter");
    EXPECT_NEAR(filter["relative_error"].back(), std::sqrt(errors), 1e-9);
    EXPECT_NEAR(filter["relative_sigma"].back(), std::sqrt(sigmas), 1e-9);
  }
}

TEST(Compare, tells_the_estimators_the_noise_that_the_tracker_measures) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-apriltag.yaml") + " --set expect=null --set duration=1",
         sequence);
  folder.write("sequence/sequence.yaml",
               "target: {type: apriltag, family: 36h11, tags: [{id: 7, size: 0.2}]}\n");
  const std::string compare =
      "compare " + sequence + " --json --errors declared --estimators filter";
  const auto measured = depthservo(compare).json();
  EXPECT_TRUE(measured["pixel_noise"].is_null()) << measured["pixel_noise"];
  const auto vague = depthservo(compare + " --pixel-noise 2").json();
  EXPECT_EQ(vague["pixel_noise"], 2);
  EXPECT_GT(estimatorNamed(vague, "filter")["relative_sigma"].back(),
            5 * estimatorNamed(measured, "filter")["relative_sigma"].back().get<double>());
}

TEST(Compare, of_natural_corners_leaves_out_the_estimator_that_needs_the_target) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set expect=null --set duration=0.3", sequence);
  const auto dots = depthservo("compare " + sequence + " --json").json();
  EXPECT_FALSE(estimatorNamed(dots, "pose").is_null());
  const Result corners = depthservo("compare " + sequence + " --tracker klt --json");
  ASSERT_EQ(corners.exitCode, 0) << corners.err;
  EXPECT_TRUE(estimatorNamed(corners.json(), "pose").is_null());
  EXPECT_FALSE(estimatorNamed(corners.json(), "filter").is_null());
}

TEST(Compare, without_truth_shows_sigmas_and_differences) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(kQuick, sequence);
  std::filesystem::remove(sequence + "/truth.csv");
  const Result result =
      depthservo("compare " + sequence + " --json --out " + (folder / "out").string());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_EQ(json["truth"], false);
  EXPECT_TRUE(json["limits"].empty());
  EXPECT_EQ(json["reference"], "filter");
  const auto joint = estimatorNamed(json, "joint");
  EXPECT_TRUE(joint["relative_error"].back().is_null());
  EXPECT_TRUE(joint["mean_nees"].is_null());
  EXPECT_LT(joint["difference"].back(), 0.05);
  EXPECT_GT(joint["relative_sigma"].back(), 0);
  EXPECT_NE(folder.read("out/report.html").find("true depths are not known"), std::string::npos);
}

TEST(Compare, writes_a_folder_with_the_same_bytes_but_for_the_times) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) {
    ASSERT_EQ(depthservo("compare " + kQuick + " --out " + (folder / name).string()).exitCode, 0);
  }
  for (const char* file : {"compare.json", "compare.csv", "report.html"}) {
    EXPECT_EQ(folder.read(std::string("a/") + file), folder.read(std::string("b/") + file)) << file;
  }
  const auto timing = nlohmann::json::parse(folder.read("a/timing.json"));
  EXPECT_EQ(timing["reference"], "nonlinear");
  EXPECT_GT(timing["estimators"]["filter"]["ratio"], 0);
  const auto curves = readCsv(folder / "a/compare.csv");
  EXPECT_EQ(curves.at("time").size(), 241u);
  EXPECT_EQ(curves.count("error_filter") + curves.count("error_limit"), 2u);
}

struct RefusedCompare {
  const char *name, *arguments, *word;
};
class CompareRefuses : public testing::TestWithParam<RefusedCompare> {};

TEST_P(CompareRefuses, with_one_line_and_nothing_written) {
  const TemporaryFolder folder;
  const Result result = depthservo("compare " + std::string(GetParam().arguments) + " --out " +
                                   (folder / "out").string());
  EXPECT_EQ(result.exitCode, 2) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_NE(result.err.find(GetParam().word), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_TRUE(folder.isEmpty());
}

const std::string kUnknownName = kQuick + " --estimators filter,magic";
const std::string kTold = kQuick + " --estimators true";
const std::string kLate = kQuick + " --times 99";
const std::string kPrior = kQuick + " --prior 2";
const std::string kMotion = kQuick + " --motion target";
const std::string kNoFile = data("scenarios/none.yaml");
const std::string kSetOnSequence = data("sequences/mire-2") + " --set seed=2";

INSTANTIATE_TEST_SUITE_P(
    Input, CompareRefuses,
    testing::Values(RefusedCompare{"unknown_estimator", kUnknownName.c_str(), "magic"},
                    RefusedCompare{"truth_as_estimator", kTold.c_str(), "true"},
                    RefusedCompare{"time_beyond_the_data", kLate.c_str(), "--times"},
                    RefusedCompare{"prior_of_a_scenario", kPrior.c_str(), "--prior"},
                    RefusedCompare{"motion_of_a_scenario", kMotion.c_str(), "--motion"},
                    RefusedCompare{"missing_file", kNoFile.c_str(), "none.yaml"},
                    RefusedCompare{"override_of_a_sequence", kSetOnSequence.c_str(), "--set"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace depthservo::test
