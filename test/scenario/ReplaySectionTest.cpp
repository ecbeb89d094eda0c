#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/scenario/run.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::inputErrorOf;
using test::isRefusal;

const std::string kScenarios = std::string(DEPTHSERVO_DATA) + "/scenarios";

/// Paths below kScenarios, without extension.
std::vector<std::string> shippedScenarios() {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(kScenarios)) {
    if (entry.path().extension() != ".yaml") continue;
    names.push_back(entry.path().lexically_relative(kScenarios).replace_extension().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void expectSame(double a, double b, const std::string& what) {
  EXPECT_NEAR(a, b, 1e-9 * std::max(1.0, std::abs(a))) << what;
}

void expectSameEstimates(const RunLog& run, const RunLog& replayed) {
  ASSERT_EQ(run.frames.size(), replayed.frames.size());
  for (std::size_t k = 0; k < run.frames.size(); ++k) {
    const auto &a = run.frames[k].features, &b = replayed.frames[k].features;
    ASSERT_EQ(a.size(), b.size()) << "frame " << k;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const std::string what = "frame " + std::to_string(k) + ", point " + std::to_string(a[i].id);
      ASSERT_EQ(a[i].id, b[i].id);
      EXPECT_EQ(a[i].measured, b[i].measured) << what;
      EXPECT_EQ(a[i].estimate.status, b[i].estimate.status) << what;
      expectSame(a[i].u, b[i].u, what + ", u");
      expectSame(a[i].v, b[i].v, what + ", v");
      expectSame(a[i].estimate.Z(), b[i].estimate.Z(), what + ", Z");
      expectSame(a[i].estimate.sigma_Z(), b[i].estimate.sigma_Z(), what + ", sigma_Z");
      if (testing::Test::HasFailure()) return;
    }
  }
}

/// Records a scenario and replays what was recorded, in no other way than the record says.
void expectSameInReplay(const std::string& name, const std::vector<std::string>& settings) {
  const test::TemporaryFolder folder;
  const Scenario scenario = Scenario::load(kScenarios + "/" + name + ".yaml", settings);
  const RunLog run = record(scenario, folder / "sequence");
  ASSERT_GT(run.frames.size(), 2u);
  const Sequence sequence(folder / "sequence");
  expectSameEstimates(run, replay(sequence, observationOf(sequence)));
}

class RecordThenReplay : public testing::TestWithParam<std::string> {};

TEST_P(RecordThenReplay, gives_the_estimates_of_the_run) {
  expectSameInReplay(GetParam(), {"duration=4", "sensing.source=geometry"});
}

std::string testName(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); },
      '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Shipped, RecordThenReplay, testing::ValuesIn(shippedScenarios()),
                         testName);

class RecordImagesThenReplay : public testing::TestWithParam<std::string> {};

TEST_P(RecordImagesThenReplay, gives_the_estimates_of_the_run) {
  expectSameInReplay(GetParam(), {"duration=0.3", "sensing.source=image"});
}

INSTANTIATE_TEST_SUITE_P(Shipped, RecordImagesThenReplay,
                         testing::Values("unicycle-4dots-noise", "unicycle-apriltag", "moving-tag",
                                         "deluca2008/points-observed",
                                         "ibuki2023/simulation-a-60fps", "ibuki2023/experiment-b"),
                         testName);

class RecordEstimatorThenReplay : public testing::TestWithParam<std::string> {};

TEST_P(RecordEstimatorThenReplay, gives_the_estimates_of_the_run) {
  expectSameInReplay("unicycle-4dots-noise",
                     {"duration=3", "sensing.source=geometry", "depth.estimator=" + GetParam()});
}

INSTANTIATE_TEST_SUITE_P(All, RecordEstimatorThenReplay,
                         testing::Values("constant", "true", "two-frame", "nonlinear", "window",
                                         "filter", "joint", "pose"),
                         testName);

TEST(Replay, with_true_depths_needs_them_to_be_recorded) {
  const test::TemporaryFolder folder;
  record(Scenario::load(kScenarios + "/unicycle-4dots.yaml",
                        {"duration=1", "sensing.source=geometry", "depth.estimator=true"}),
         folder / "sequence");
  fs::remove(folder / "sequence/truth.csv");
  const Sequence sequence(folder / "sequence");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { replay(sequence, observationOf(sequence)); }),
                        {"sequence", "'true'", "truth.csv"}));
}

TEST(Replay, finds_no_plate_of_dots_that_lie_off_its_plane) {
  const test::TemporaryFolder folder;
  record(Scenario::load(kScenarios + "/ibuki2023/simulation-a-60fps.yaml", {"duration=0.05"}),
         folder / "sequence");
  std::string settings = folder.read("sequence/sequence.yaml");
  const std::size_t at = settings.find("\ndots:");
  ASSERT_NE(at, std::string::npos);
  settings.erase(at, settings.find('\n', at + 1) - at);
  folder.write("sequence/sequence.yaml", settings);
  const Sequence sequence(folder / "sequence");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { replay(sequence, observationOf(sequence)); }),
                        {"target", "z = 0"}));
}

class ReplaySectionTest : public testing::Test {
 protected:
  ObservationOptions read(const std::string& section) const {
    folder_.write("sequence.yaml", "dots: [[1, 2]]\nreplay:\n" + section);
    return observationOf(readTarget(folder_ / "sequence.yaml").replay);
  }
  std::string refusal(const std::string& section) const {
    return inputErrorOf([&] { read(section); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(ReplaySectionTest, keys_mean_what_they_always_meant) {
  const ObservationOptions o = read(
      "  {estimator: joint, prior: 3, pixel_noise: 0.2, odometry_noise: [0.01, 0.02],\n"
      "   odometry_mode: commanded, odometry_scale_sigma: 0.03, focal_sigma: 0.04,\n"
      "   joint: {focal: true}, Z_min: 0.1, Z_max: 50, settling: 2, W_min: 0.05, k: 20, k_3: "
      "8000,\n"
      "   ke: 5, kappa: 0.3}\n");
  EXPECT_EQ(o.depth.estimator, EstimatorKind::joint);
  EXPECT_EQ(o.depth.initial, 3);
  EXPECT_EQ(o.pixelNoise_px, 0.2);
  EXPECT_TRUE(o.isPixelNoiseGiven);
  ASSERT_TRUE(o.odometryNoise.has_value());
  EXPECT_EQ(o.odometryNoise->sigma_v, 0.01);
  EXPECT_EQ(o.odometryNoise->sigma_w, 0.02);
  EXPECT_EQ(o.odometryNoise->relative_v, 0);
  EXPECT_EQ(o.odometryNoise->mode, OdometryMode::commanded);
  EXPECT_EQ(o.odometryScaleSigma, 0.03);
  EXPECT_EQ(o.focalSigma, 0.04);
  EXPECT_TRUE(o.depth.joint.time_offset);
  EXPECT_FALSE(o.depth.joint.gyro_bias);
  EXPECT_TRUE(o.depth.joint.focal);
  EXPECT_EQ(o.depth.Z_min, 0.1);
  EXPECT_EQ(o.depth.Z_max, 50);
  EXPECT_EQ(o.depth.gains.settling, 2);
  EXPECT_EQ(o.depth.gains.W_min, 0.05);
  EXPECT_EQ(o.depth.gains.k, 20);
  EXPECT_EQ(o.depth.gains.k_3, 8000);
  EXPECT_EQ(o.depth.pose.ke, 5);
  EXPECT_EQ(o.depth.pose.kappa, 0.3);
}

TEST_F(ReplaySectionTest, leaves_defaults_for_what_it_does_not_say) {
  const ObservationOptions defaults, o = read("  {prior: 2}\n");
  EXPECT_EQ(o.depth.estimator, defaults.depth.estimator);
  EXPECT_EQ(o.pixelNoise_px, defaults.pixelNoise_px);
  EXPECT_FALSE(o.isPixelNoiseGiven);
  EXPECT_FALSE(o.odometryNoise.has_value());
  EXPECT_FALSE(o.depth.pose.ke.has_value());
  EXPECT_FALSE(o.depth.pose.coupledGoal.has_value());
  EXPECT_EQ(read("  {odometry_noise: [0, 0]}\n").odometryNoise->deadBand,
            OdometryNoise::none().deadBand);
  EXPECT_EQ(observationOf(ReplaySection{}).depth.initial, defaults.depth.initial);
}

TEST_F(ReplaySectionTest, is_read_as_it_was_written) {
  ObservationOptions options;
  options.depth.estimator = EstimatorKind::nonlinear;
  options.depth.object = true;
  options.depth.initial = 1.0 / 3;
  options.depth.gains.k = 48;
  options.depth.gains.k_3 = 0.1 + 0.2;
  options.depth.pose.guard = false;
  options.depth.pose.coupledGoal =
      Eigen::Translation3d(1, -2, 0.1) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2) / 3);
  options.depth.pose.couplingStep_s = 1.0 / 300;
  options.depth.pose.kc = 6.5;
  options.odometryNoise = OdometryNoise::white(1e-7, 0.2, OdometryMode::commanded);
  std::string section;
  std::istringstream lines(replayYaml(options));
  for (std::string line; std::getline(lines, line);) section += "  " + line + "\n";
  const ObservationOptions o = read(section);
  EXPECT_EQ(o.depth.estimator, EstimatorKind::nonlinear);
  EXPECT_TRUE(o.depth.object);
  EXPECT_EQ(o.depth.initial, 1.0 / 3);
  EXPECT_EQ(o.depth.gains.k_3, 0.1 + 0.2);
  EXPECT_FALSE(o.depth.pose.guard);
  ASSERT_TRUE(o.depth.pose.coupledGoal.has_value());
  EXPECT_TRUE(o.depth.pose.coupledGoal->isApprox(*options.depth.pose.coupledGoal, 1e-14));
  EXPECT_EQ(o.depth.pose.couplingStep_s, 1.0 / 300);
  EXPECT_EQ(o.depth.pose.kc, 6.5);
  EXPECT_FALSE(o.isPixelNoiseGiven);
  EXPECT_EQ(o.odometryNoise->sigma_v, 1e-7);
  EXPECT_EQ(o.odometryNoise->mode, OdometryMode::commanded);
}

TEST_F(ReplaySectionTest, faults_are_refused_with_line_and_key) {
  EXPECT_TRUE(isRefusal(refusal("  prior: 3\n  pixel_nois: 1\n"),
                        {"sequence.yaml:4: replay.pixel_nois", "'replay.pixel_noise'"}));
  EXPECT_TRUE(isRefusal(refusal("  estimator: flter\n"),
                        {"sequence.yaml:3: replay.estimator", "nearest is 'filter'"}));
  EXPECT_TRUE(isRefusal(refusal("  prior: -1\n"), {":3: replay.prior", "(0, "}));
  EXPECT_TRUE(isRefusal(refusal("  prior: 1\n  k_3: 5\n"), {":4: replay.k_3", "k and k_3"}));
  EXPECT_TRUE(isRefusal(refusal("  Z_min: 5\n  Z_max: 4\n"), {":3: replay.Z_min", "Z_max = 4"}));
  EXPECT_TRUE(isRefusal(refusal("  object: true\n"), {":3: replay.object", "nonlinear"}));
  EXPECT_TRUE(isRefusal(refusal("  coupled: {xyz: [0, 0, 1], quaternion: [0, 0, 0, 2]}\n"),
                        {":3: replay.coupled.quaternion", "1.1"}));
  EXPECT_TRUE(isRefusal(refusal("  coupled: {xyz: [0, 0, 1], quaternion: [0, 0, 0, 0.5]}\n"),
                        {":3: replay.coupled.quaternion", "norm 0.5"}));
  EXPECT_TRUE(isRefusal(refusal("  coupled: {xyz: [0, 0, 1]}\n"),
                        {":3: replay.coupled.quaternion", "missing"}));
}

}  // namespace
}  // namespace depthservo
