#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "cli/Tool.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const std::string kGeneral = data("scenarios/free-general.yaml");

struct Fault {
  const char *setting, *cause;
  double size, tolerance;
};
void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.setting; }

class WithFault : public testing::TestWithParam<Fault> {};

TEST_P(WithFault, names_it_in_json_on_stderr_as_an_event_and_in_the_report) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  const Result run = depthservo("run " + kGeneral + " --json --out " + out + " --set '" +
                                GetParam().setting + "'");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  const auto& diagnosis = json["diagnosis"];
  EXPECT_EQ(diagnosis["cause"], GetParam().cause) << diagnosis;
  EXPECT_NEAR(diagnosis["size"], GetParam().size, GetParam().tolerance) << diagnosis;
  EXPECT_GT(diagnosis["evidence_sigma"], 5);
  const std::string message = diagnosis["message"];
  EXPECT_NE(run.err.find("diagnosis: " + message), std::string::npos) << run.err;
  const auto events = nlohmann::json::parse(folder.read("run/run.json"))["events"];
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events[0]["time"], diagnosis["first_s"]);
  EXPECT_NE(folder.read("run/report.html").find("<b>Self-diagnosis</b>"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, WithFault,
    testing::Values(Fault{"sensing.latency=0.0333333333", "latency", .0333, .01},
                    Fault{"camera.focal_error=0.05", "focal-length", .05, .015},
                    Fault{"odometry.gyro_bias=[0, 0.02, 0]", "gyro-bias", .02, .004},
                    Fault{"sensing.outliers=0.04", "outliers", .04, .02},
                    Fault{"target.twist=[{until: 10, v: [0.03, 0.02, 0.01, 0, 0, 0]}]",
                          "moving-target", .037, .02}));

TEST(SelfDiagnosis, is_silent_with_clean_sensors) {
  for (const char* scenario : {"free-general", "unicycle-4dots", "unicycle-4dots-noise"}) {
    const Result run =
        depthservo("run " + data(std::string("scenarios/") + scenario + ".yaml") + " --json");
    EXPECT_EQ(run.json()["diagnosis"]["cause"], "none") << scenario;
    EXPECT_EQ(run.json()["diagnosis"]["variance_factor"], 1) << scenario;
    EXPECT_EQ(run.err.find("diagnosis:"), std::string::npos) << run.err;
  }
}

class Recorded : public testing::Test {
 protected:
  void SetUp() override { record(""); }
  void record(const std::string& settings) {
    sequence_ = folder_ / ("sequence" + std::to_string(settings.size()));
    test::record(kGeneral + " " + settings, sequence_);
  }
  void edit(const std::string& file, const std::string& from, const std::string& to) {
    const std::string name = std::filesystem::path(sequence_).filename().string() + "/" + file;
    std::string text = folder_.read(name);
    ASSERT_NE(text.find(from), std::string::npos) << text;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
    folder_.write(name, text);
  }
  TemporaryFolder folder_;
  std::string sequence_;
};

TEST_F(Recorded, odometry_shifted_by_a_frame_is_named_as_latency_and_learnt_by_the_joint_filter) {
  const std::string twists =
      folder_.read(std::filesystem::path(sequence_).filename().string() + "/twist.csv");
  std::istringstream in(twists);
  std::string line, shifted;
  std::getline(in, line);
  shifted = line + "\n";
  while (std::getline(in, line)) {
    const std::size_t comma = line.find(',');
    char time[32];
    std::snprintf(time, sizeof time, "%.9f", std::stod(line.substr(0, comma)) - 1. / 30);
    shifted += time + line.substr(comma) + "\n";
  }
  folder_.write(std::filesystem::path(sequence_).filename().string() + "/twist.csv", shifted);

  const auto json = depthservo("replay " + sequence_ + " --json").json();
  EXPECT_EQ(json["diagnosis"]["cause"], "latency") << json["diagnosis"];
  EXPECT_LT(json["diagnosis"]["first_s"], 3);

  const Result joint = depthservo("replay " + sequence_ + " --joint time-offset --json");
  const auto learnt = joint.json()["joint"]["time_offset"];
  EXPECT_NEAR(learnt["value"], 1. / 30, .002) << learnt;
  EXPECT_EQ(learnt["observed"], true);
  EXPECT_NE(joint.err.find("joint filter: images are 3"), std::string::npos) << joint.err;
  EXPECT_EQ(joint.json()["diagnosis"]["compensated"], true);
}

TEST_F(Recorded, focal_length_given_five_percent_wrong_is_recovered_to_half_a_percent) {
  edit("camera.yaml", "600", "570");
  const auto plain = depthservo("replay " + sequence_ + " --json").json();
  EXPECT_EQ(plain["diagnosis"]["cause"], "focal-length") << plain["diagnosis"];

  const Result result = depthservo("replay " + sequence_ + " --joint time-offset,focal --json");
  const auto json = result.json();
  const auto& focal = json["joint"]["focal"];
  EXPECT_NEAR(focal["value"], 600. / 570, .005 * 600. / 570) << focal;
  EXPECT_EQ(focal["observed"], true);
  EXPECT_NE(result.err.find("joint filter: focal length "), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("% of the given one"), std::string::npos) << result.err;
  for (const auto& point : json["points"]) EXPECT_LT(point["relative_error"], .01) << point;
}

TEST_F(Recorded, focal_length_is_said_to_be_unknown_when_the_motion_does_not_show_it) {
  record(
      "--set 'control.profile=[{until: 10, amplitude: [0.2, 0, 0, 0, 0, 0], "
      "omega: [1.26, 1, 1, 1, 1, 1]}]'");
  edit("camera.yaml", "600", "570");
  const Result result = depthservo("replay " + sequence_ + " --joint focal --json");
  EXPECT_EQ(result.json()["joint"]["focal"]["observed"], false) << result.json()["joint"];
  EXPECT_NE(result.err.find("focal length is not known"), std::string::npos) << result.err;
}

TEST_F(Recorded, declared_uncertainties_enter_sigma) {
  const auto relativeSigma = [&](const std::string& options) {
    const auto points = depthservo("replay " + sequence_ + " --json " + options).json()["points"];
    return points[0]["sigma_Z"].get<double>() / points[0]["Z"].get<double>();
  };
  const double plain = relativeSigma("");
  EXPECT_NEAR(relativeSigma("--odometry-scale-sigma 0.02"), std::hypot(plain, .02), .002);
  const double focal = relativeSigma("--focal-sigma 0.02");
  EXPECT_GT(focal, .01);
  EXPECT_LT(focal, .03);
}

TEST(Joint, refuses_what_it_cannot_learn_and_estimators_it_is_not_for) {
  const std::string replay = "replay " + data("sequences/mire-2") + " --joint ";
  for (const char* arguments : {"depth", "focal,none", "focal --estimator filter"}) {
    const Result result = depthservo(replay + arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_NE(result.err.find("--joint"), std::string::npos) << result.err;
  }
}

/// What the diagnosis says where the poses that tell the motion err by so much per axis [m].
std::string causeWithPoses(const TemporaryFolder& folder, double sigma_m) {
  const std::string name = fmt::format("poses-{}", sigma_m);
  record(data("scenarios/robots/wheeled.yaml") +
             " --set seed=3 --set duration=8 --set sensing.latency=0 --set sensing.stamp_jitter=0 "
             "--set robot.mount_drawn=0 --set camera.focal_drawn=0",
         (folder / name).string());
  std::istringstream lines(folder.read(name + "/groundtruth.txt"));
  Random random(1);
  std::string noisy;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream pose(line);
    double t, x, y, z;
    std::string rotation;
    if (!(pose >> t >> x >> y >> z) || !std::getline(pose, rotation)) continue;
    const auto off = [&] { return random.normal(sigma_m); };
    noisy += fmt::format("{:.9f} {} {} {}{}\n", t, x + off(), y + off(), z + off(), rotation);
  }
  folder.write(name + "/groundtruth.txt", noisy);
  const Result result = depthservo("replay " + (folder / name).string() +
                                   " --motion groundtruth --errors poses "
                                   "--prior 3 --json");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  return result.json()["diagnosis"]["cause"];
}

TEST(SelfDiagnosis, names_poses_that_err_much_more_than_the_profile_allows) {
  const TemporaryFolder folder;
  EXPECT_EQ(causeWithPoses(folder, .002), "none");
  EXPECT_EQ(causeWithPoses(folder, .01), "pose-noise");
  EXPECT_EQ(causeWithPoses(folder, .03), "pose-noise");
}

}  // namespace
}  // namespace depthservo::test
