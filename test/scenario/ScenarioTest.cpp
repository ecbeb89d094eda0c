#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "depthservo/scenario/Scenario.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"
#include "support/TextMutator.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::inputErrorOf;
using test::isRefusal;

const char* const kMinimal =
    "name: minimal\n"                                                                        // 1
    "duration: 10\n"                                                                         // 2
    "camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 30}\n"  // 3
    "target:\n"                                                                              // 4
    "  points: [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0]]\n"                           // 5
    "robot:\n"                                                                               // 6
    "  type: unicycle\n"                                                                     // 7
    "  initial: {x: -3.9, y: 0.3, theta: 0}\n"                                               // 8
    "  goal: {x: -1, y: 0, theta: 0}\n"                                                      // 9
    "depth: {initial: 3}\n";                                                                 // 10

class ScenarioTest : public testing::Test {
 protected:
  Scenario load(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    folder_.write("s.yaml", text);
    return Scenario::load(folder_ / "s.yaml", overrides);
  }
  Scenario loadWith(const std::vector<std::string>& overrides) const {
    return load(kMinimal, overrides);
  }
  std::string refusal(const std::string& text,
                      const std::vector<std::string>& overrides = {}) const {
    return inputErrorOf([&] { load(text, overrides); });
  }

  test::TemporaryFolder folder_;
};

std::string shipped(const std::string& name) {
  return std::string(DEPTHSERVO_DATA) + "/scenarios/" + name;
}

TEST_F(ScenarioTest, every_shipped_scenario_is_read) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(shipped(""))) {
    if (entry.path().extension() != ".yaml") continue;
    const Scenario scenario = Scenario::load(entry.path());
    EXPECT_EQ(scenario.name, entry.path().stem());
    EXPECT_TRUE(scenario.expect.has_value());
    ++count;
  }
  EXPECT_GE(count, 4);
}

TEST_F(ScenarioTest, has_defaults_for_all_but_the_necessary) {
  const Scenario s = loadWith({});
  EXPECT_EQ(s.depth.estimator, EstimatorKind::filter);
  EXPECT_EQ(s.control.gain, 0.57);
  EXPECT_EQ(s.robot.limits.v, 0.5);
  EXPECT_EQ(s.sensing.source, SensingSource::image);
  EXPECT_FALSE(s.expect.has_value());
  EXPECT_EQ(s.sensing.assumedNoise_px(), 0.1);
  EXPECT_EQ(loadWith({"sensing.pixel_noise=0.4"}).sensing.assumedNoise_px(), 0.4);
  EXPECT_EQ(loadWith({"sensing.assumed_noise=0.02"}).sensing.assumedNoise_px(), 0.02);
}

TEST_F(ScenarioTest, the_default_plate_faces_a_camera_that_looks_along_world_x) {
  const Eigen::Isometry3d wMo = loadWith({}).target.pose.isometry();
  const auto inWorld = [&](double x, double y, double z) -> Eigen::Vector3d {
    return wMo.linear() * Eigen::Vector3d(x, y, z);
  };
  EXPECT_TRUE(inWorld(1, 0, 0).isApprox(Eigen::Vector3d(0, -1, 0), 1e-15));
  EXPECT_TRUE(inWorld(0, 1, 0).isApprox(Eigen::Vector3d(0, 0, -1), 1e-15));
  EXPECT_TRUE(inWorld(0, 0, 1).isApprox(Eigen::Vector3d(1, 0, 0), 1e-15));
  EXPECT_EQ(wMo.translation(), Eigen::Vector3d(0, 0, 0.13));
  EXPECT_EQ(Scenario::load(shipped("unicycle-4dots.yaml")).target.pose.isometry().matrix(),
            wMo.matrix());
}

TEST_F(ScenarioTest, rpy_turns_about_x_then_y_then_z_of_the_world) {
  RpyPose pose;
  pose.rpy = {0.3, 0.4, 0.5};
  const double cr = std::cos(0.3), sr = std::sin(0.3), cp = std::cos(0.4), sp = std::sin(0.4),
               cy = std::cos(0.5), sy = std::sin(0.5);
  Eigen::Matrix3d expected;
  expected << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,          //
      -sp, cp * sr, cp * cr;
  EXPECT_LT((pose.isometry().linear() - expected).norm(), 1e-15);
}

TEST_F(ScenarioTest, hidden_comes_as_pairs_as_mappings_and_as_one_mapping) {
  const auto hidden =
      loadWith({"sensing.hidden=[[1, 2], {from: 3, to: 4, points: [0, 2]}]"}).sensing.hidden;
  ASSERT_EQ(hidden.size(), 2u);
  EXPECT_TRUE(hidden[0].covers(1, 1));
  EXPECT_FALSE(hidden[0].covers(2, 1));
  EXPECT_TRUE(hidden[1].covers(3.5, 2));
  EXPECT_FALSE(hidden[1].covers(3.5, 1));
  EXPECT_EQ(loadWith({"sensing.hidden={from: 3, to: 4}"}).sensing.hidden.size(), 1u);
}

TEST_F(ScenarioTest, gains_are_given_by_settling_or_as_numbers) {
  const ObserverGains scheduled = loadWith({"depth.gains={settling: 2}"}).depth.gains.observer();
  EXPECT_EQ(scheduled.W_min, 0.01);
  EXPECT_NEAR(scheduled.wn, 5.83 / 2, 1e-2);
  const ObserverGains given = loadWith({"depth.gains={k: 48, k_3: 44000}"}).depth.gains.observer();
  EXPECT_EQ(given.k, 48);
  EXPECT_EQ(given.k_3, 44000);
  EXPECT_EQ(given.W_min, 0);
}

TEST_F(ScenarioTest, desired_pixels_replace_the_goal) {
  const Scenario s =
      loadWith({"robot.goal=null", "control.desired=[[10, 20], [30, 20], [30, 40]]"});
  EXPECT_FALSE(s.robot.goal.has_value());
  EXPECT_EQ(s.control.desired[1], Eigen::Vector2d(30, 20));
}

TEST_F(ScenarioTest, overrides_are_applied_in_order_and_make_missing_sections) {
  const Scenario s = loadWith({"odometry.noise=[0.1, 0.2]", "control.gain=1", "control.gain=2",
                               "name='a=b'", "expect.outcome=left-image"});
  EXPECT_EQ(s.odometry.noise, Eigen::Vector2d(0.1, 0.2));
  EXPECT_EQ(s.control.gain, 2);
  EXPECT_EQ(s.name, "a=b");
  EXPECT_EQ(s.expect->outcome, Outcome::leftImage);
}

TEST_F(ScenarioTest, the_effective_configuration_is_a_scenario_itself) {
  for (const auto& entry : fs::recursive_directory_iterator(shipped(""))) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string json = Scenario::load(entry.path()).toJson();
    EXPECT_EQ(load(json).toJson(), json);
  }
  const std::string full =
      loadWith({"sensing.assumed_noise=0.1", "depth.gains={k: 1, k_3: 0.1}", "seed=4294967295",
                "robot.goal=null", "control.desired=[[10, 20], [30, 20], [30, 40.1]]",
                "sensing.hidden=[[0.1, 0.3]]", "target.twist=[{until: 5, v: [0, 0, 0, 0, 0, 0]}]",
                "name=\xc3\xa9\"'"})
          .toJson();
  EXPECT_EQ(load(full).toJson(), full);
}

TEST_F(ScenarioTest, the_effective_configuration_has_every_key) {
  const auto parsed = [&](const std::vector<std::string>& overrides) {
    return nlohmann::json::parse(loadWith(overrides).toJson());
  };
  const auto profile =
      parsed({"sensing.hidden=[[1, 2]]", "sensing.swapped=[{from: 1, to: 2, points: [0, 1]}]",
              "sensing.source=geometry", "odometry.gaps=[[1, 2]]", "robot.stuck=[[1, 2]]",
              "expect.outcome=converged", "target.twist=[{until: 5, v: [0, 0, 0, 0, 0, 0]}]",
              "control.law=profile", "robot.goal=null", "control.profile=[{until: 5, v: [0.1, 0]}]",
              "control.excite={speed: 0.1}"});
  const auto tags = parsed({"target={type: apriltag, family: 36h11, tags: [{id: 0, size: 0.2}]}",
                            "sensing.tracker=apriltag"});
  const auto walls = parsed({"target={type: wall, walls: [{width: 1}]}", "sensing.tracker=klt"});
  const auto boards =
      parsed({"target={type: charuco, columns: 5, rows: 4, square: 0.05, marker: 0.03}",
              "sensing.tracker=charuco"});
  const std::set<std::string> ofBoards{"target.columns", "target.rows", "target.square",
                                       "target.marker", "target.dictionary"};
  for (const std::string& key : Scenario::keys()) {
    const bool isOfTags = key.rfind("target.tags", 0) == 0 || key == "target.family" ||
                          key.rfind("robot.goal", 0) == 0;
    const bool isOfWalls = key.rfind("target.walls", 0) == 0;
    const nlohmann::json* at = isOfTags                  ? &tags
                               : isOfWalls               ? &walls
                               : ofBoards.count(key) > 0 ? &boards
                                                         : &profile;
    std::string rest = key + ".";
    for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest.erase(0, dot + 1)) {
      if (at->is_array()) at = &at->at(0);
      ASSERT_TRUE(at->contains(rest.substr(0, dot))) << key;
      at = &at->at(rest.substr(0, dot));
    }
  }
}

TEST_F(ScenarioTest, the_run_json_of_a_run_is_a_scenario) {
  const std::string configuration = loadWith({"control.gain=0.3"}).toJson();
  const std::string head = R"({"command": "run", "name": "x", "metrics": {}, "configuration": )";
  EXPECT_EQ(load(head + configuration + "}").toJson(), configuration);
  EXPECT_EQ(load(head + configuration + "}", {"control.gain=0.4"}).control.gain, 0.4);
  EXPECT_TRUE(isRefusal(refusal(R"({"command": "replay", "configuration": {"prior_Z": 1}})"),
                        {"s.yaml", "configuration", "replay"}));
}

TEST_F(ScenarioTest, keys_of_another_type_of_target_are_refused) {
  EXPECT_TRUE(isRefusal(refusal(kMinimal, {"target.family=36h11"}),
                        {"--set target.family=36h11", "target.type: apriltag"}));
  EXPECT_TRUE(isRefusal(refusal(kMinimal, {"target.tags=[{id: 0, size: 0.2}]"}),
                        {"target.tags", "target.type: apriltag"}));
  EXPECT_TRUE(isRefusal(
      refusal(kMinimal, {"target={type: apriltag, radius: 0.02, tags: [{id: 0, size: 0.2}]}"}),
      {"target.radius", "target.type: dots"}));
  EXPECT_TRUE(isRefusal(refusal(kMinimal, {"sensing.tracker=apriltag"}),
                        {"sensing.tracker", "target.type"}));
  EXPECT_EQ(loadWith({"sensing.tracker=dots"}).toJson(), loadWith({}).toJson());
}

struct BrokenScenario {
  const char* name;
  std::string remove;  ///< text taken out of the minimal scenario
  std::string insert;  ///< text put in its place
  std::vector<std::string> words;
};
void PrintTo(const BrokenScenario& broken, std::ostream* out) { *out << broken.name; }

class BrokenScenarioTest : public ScenarioTest,
                           public testing::WithParamInterface<BrokenScenario> {};

TEST_P(BrokenScenarioTest, is_refused_with_line_key_and_reason) {
  std::string text = kMinimal;
  const std::size_t at = text.find(GetParam().remove);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, GetParam().remove.size(), GetParam().insert);
  std::vector<std::string> words = GetParam().words;
  words.push_back("s.yaml");
  EXPECT_TRUE(isRefusal(refusal(text), words));
}

const std::string kDepth = "depth: {initial: 3}\n";
INSTANTIATE_TEST_SUITE_P(
    , BrokenScenarioTest,
    testing::Values(
        BrokenScenario{"unknown_key", "duration", "duratoin", {":2: duratoin", "'duration'"}},
        BrokenScenario{"unknown_below",
                       "theta",
                       "thata",
                       {":8: robot.initial.thata", "'robot.initial.theta'"}},
        BrokenScenario{"missing_name", "name: minimal\n", "", {"name", "missing"}},
        BrokenScenario{"missing_section", kDepth, "", {"depth", "missing"}},
        BrokenScenario{"missing_below", ", fy: 600", "", {":3: camera.fy", "missing"}},
        BrokenScenario{"wrong_type",
                       "duration: 10",
                       "duration: long",
                       {":2: duration", "(0, 3600] s", "'long'"}},
        BrokenScenario{"out_of_range", "fx: 600", "fx: -600", {":3: camera.fx", "(0, 100000] px"}},
        BrokenScenario{"nan", "initial: 3}", "initial: .nan}", {":10: depth.initial", "finite"}},
        BrokenScenario{"fraction_of_a_pixel", "width: 640", "width: 640.5", {":3: camera.width"}},
        BrokenScenario{"no_points",
                       "[[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0]]",
                       "[]",
                       {":5: target.points", "1 to 64"}},
        BrokenScenario{
            "flat_points", "[0.1, 0.1, 0]", "[0.1, 0.1]", {":5: target.points", "3 numbers"}},
        BrokenScenario{
            "same_points", "[0.1, 0.1, 0]", "[0.1, -0.1, 0]", {":5: target.points", "same"}},
        BrokenScenario{
            "free_camera_on_the_floor", "unicycle", "free", {":8: robot.initial.xyz", "missing"}},
        BrokenScenario{"unicycle_in_the_air",
                       "theta: 0}\n  goal",
                       "theta: 0, xyz: [1, 2, 3]}\n  goal",
                       {":8: robot.initial", "for robot.type free"}},
        BrokenScenario{"pan_without_platform",
                       "theta: 0}\n  goal",
                       "theta: 0, pan: 1}\n  goal",
                       {":8: robot.initial", "pan-unicycle"}},
        BrokenScenario{"lag_without_drives",
                       "type: unicycle",
                       "type: omni\n  lag: 0.1",
                       {":8: robot.lag", "unicycle"}},
        BrokenScenario{"task_law_of_a_unicycle",
                       kDepth,
                       kDepth + "control: {law: task}\n",
                       {":11: control.law", "pan-unicycle, omni or free"}},
        BrokenScenario{"profile_law_without_profile",
                       kDepth,
                       kDepth + "control: {law: profile}\n",
                       {"control.profile", "velocities"}},
        BrokenScenario{"profile_of_another_robot",
                       kDepth,
                       kDepth + "control: {law: profile, profile: [{until: 1, v: [1]}]}\n",
                       {":11: control.profile", "v: expected 2 numbers, got 1"}},
        BrokenScenario{"no_rate", "rate: 30", "rate: []", {":3: camera.rate", "a list of numbers"}},
        BrokenScenario{"twist_of_the_target",
                       "robot:",
                       "  twist: [{until: 1, v: [0, 0, 1]}]\nrobot:",
                       {":6: target.twist", "expected 6 numbers"}},
        BrokenScenario{
            "unknown_robot",
            "unicycle",
            "unycycle",
            {":7: robot.type", "expected unicycle, pan-unicycle", "nearest is 'unicycle'"}},
        BrokenScenario{"no_goal",
                       "  goal: {x: -1, y: 0, theta: 0}\n",
                       "",
                       {"robot.goal", "exactly one", "control.desired"}},
        BrokenScenario{"two_goals",
                       kDepth,
                       kDepth + "control: {desired: [[1, 1], [2, 1], [3, 3]]}\n",
                       {":11: control.desired", "exactly one"}},
        BrokenScenario{"principal_point", "cx: 319.5", "cx: 700", {":3: camera", "640x480"}},
        BrokenScenario{"pose_of_three_points",
                       "initial: 3}",
                       "initial: 3, estimator: pose}",
                       {"target.points", "at least four points"}},
        BrokenScenario{"unknown_estimator",
                       "initial: 3}",
                       "initial: 3, estimator: nonlinaer}",
                       {"depth.estimator", "'nonlinear'"}},
        BrokenScenario{"depth_limits",
                       "initial: 3}",
                       "initial: 3, Z_min: 5, Z_max: 4}",
                       {":10: depth.Z_min", "Z_max"}},
        BrokenScenario{
            "guess_outside", "initial: 3}", "initial: 300}", {":10: depth.initial", "Z_max = 100"}},
        BrokenScenario{"half_the_gains",
                       "initial: 3}",
                       "initial: 3, gains: {k: 3}}",
                       {":10: depth.gains", "k_3"}},
        BrokenScenario{"features",
                       kDepth,
                       kDepth + "control: {features: lines}\n",
                       {":11: control.features", "expected points or moments"}},
        BrokenScenario{"moments_without_vpServo",
                       kDepth,
                       kDepth + "control: {features: moments, law: profile, "
                                "profile: [{until: 1, v: [1, 0]}]}\n",
                       {":11: control.features", "moments need control.law: vpServo"}},
        BrokenScenario{"one_depth_of_an_estimator_that_has_none",
                       "initial: 3}",
                       "initial: 3, object: true}",
                       {":10: depth.object", "needs the estimator nonlinear, not filter"}},
        BrokenScenario{"joints_of_a_unicycle",
                       "theta: 0}\n  goal",
                       "theta: 0, joints: [0, 1, 0]}\n  goal",
                       {":8: robot.initial", "joints are for robot.type mobile-manipulator"}},
        BrokenScenario{"task_law_of_an_arm",
                       kDepth,
                       kDepth + "control: {law: task}\n",
                       {":11: control.law", "pan-unicycle, omni or free"}},
        BrokenScenario{"law",
                       kDepth,
                       kDepth + "control: {law: tusk}\n",
                       {":11: control.law", "expected vpServo, task", "nearest is 'task'"}},
        BrokenScenario{"hidden_backwards",
                       kDepth,
                       kDepth + "sensing: {hidden: [[3, 2]]}\n",
                       {":11: sensing.hidden", "before"}},
        BrokenScenario{"hidden_triple",
                       kDepth,
                       kDepth + "sensing: {hidden: [[3, 4, 5]]}\n",
                       {":11: sensing.hidden", "mapping"}},
        BrokenScenario{"hidden_point",
                       kDepth,
                       kDepth + "sensing: {hidden: [{from: 3, to: 4, points: [3]}]}\n",
                       {":11: sensing.hidden", "no point 3", "0 to 2"}},
        BrokenScenario{"hidden_points_far_off",
                       kDepth,
                       kDepth + "sensing: {hidden: [{from: 3, to: 4, points: [0, 99]}]}\n",
                       {":11: sensing.hidden", "no point 99", "0 to 2"}},
        BrokenScenario{"exposure",
                       kDepth,
                       kDepth + "sensing: {exposure: 0.04}\n",
                       {":11: sensing.exposure", "longer"}},
        BrokenScenario{"outcome",
                       kDepth,
                       kDepth + "expect: {outcome: success}\n",
                       {":11: expect.outcome", "converged", "left-image", "timeout"}},
        BrokenScenario{"twice", kDepth, kDepth + kDepth, {":11: depth", "twice", "line 10"}},
        BrokenScenario{
            "endless_number", "fx: 600", "fx: 6" + std::string(5000, '0'), {":3: camera.fx"}}),
    [](const auto& param) { return std::string(param.param.name); });

TEST_F(ScenarioTest, a_broken_override_is_refused_by_its_option) {
  const auto refused = [&](const std::string& setting) { return refusal(kMinimal, {setting}); };
  EXPECT_TRUE(isRefusal(refused("depth.initail=3"),
                        {"s.yaml", "--set depth.initail=3", "'depth.initial'"}));
  EXPECT_TRUE(isRefusal(refused("depth.initial=-1"), {"s.yaml", "--set depth.initial=-1", "(0, "}));
  EXPECT_TRUE(isRefusal(refused("depth.initial=1000"), {"--set depth.initial=1000", "Z_max"}));
  EXPECT_TRUE(isRefusal(refused("depth.initial"), {"--set", "key.path=value"}));
  EXPECT_TRUE(isRefusal(refused("=3"), {"--set", "key.path=value"}));
  EXPECT_TRUE(isRefusal(refused("depth.initial="), {"--set depth.initial=", "null"}));
  EXPECT_TRUE(isRefusal(refused("depth.initial=null"), {"depth.initial", "missing"}));
  EXPECT_TRUE(isRefusal(refused("depth.initial=[3"), {"--set", "YAML"}));
  EXPECT_TRUE(isRefusal(refused("depth={initial: 3, foo: 1}"), {"--set", "depth.foo", "unknown"}));
  EXPECT_TRUE(isRefusal(refused("sensing.hidden=[[2, 1]]"), {"--set sensing.hidden", "before"}));
  EXPECT_TRUE(isRefusal(refused(std::string("seed=\0\x01", 7)), {"--set"}));
  EXPECT_TRUE(isRefusal(refused("seed=" + std::string(100000, '1')), {"--set"}));
}

TEST_F(ScenarioTest, a_file_that_is_no_scenario_is_refused) {
  EXPECT_TRUE(isRefusal(refusal("just text"), {"s.yaml", "mapping"}));
  EXPECT_TRUE(isRefusal(refusal("just text", {"seed=3"}), {"s.yaml", "mapping"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { Scenario::load(folder_ / "none.yaml"); }),
                        {"none.yaml", "no such file"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { Scenario::load(folder_.path()); }), {"folder"}));
}

TEST_F(ScenarioTest, any_text_gives_a_sane_scenario_or_an_input_error) {
  std::ifstream file(shipped("unicycle-4dots-hidden.yaml"));
  const std::string valid{std::istreambuf_iterator<char>(file), {}};
  test::Random random(7);
  int accepted = 0;
  for (int round = 0; round < 600; ++round) {
    const std::string text = test::mutated(valid, random);
    try {
      const Scenario scenario = load(text);
      ++accepted;
      EXPECT_GT(scenario.camera.fx, 0);
      EXPECT_GT(scenario.depth.initial, 0);
      EXPECT_EQ(load(scenario.toJson()).toJson(), scenario.toJson());
    } catch (const InputError& e) {
      EXPECT_TRUE(isRefusal(e.what(), {"s.yaml"})) << text;
    }
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 550);
}

TEST(EstimatorNameTest, names_of_scenarios_are_accepted_elsewhere_too) {
  EXPECT_EQ(estimatorNamed("true", {"--estimator", 0, ""}), EstimatorKind::trueDepth);
  EXPECT_STREQ(toString(EstimatorKind::twoFrame), "two-frame");
  EXPECT_EQ(estimatorNamed("pose", {"--estimator", 0, ""}), EstimatorKind::pose);
  EXPECT_TRUE(isRefusal(inputErrorOf([] {
                          estimatorNamed("fliter", {"--estimator", 0, ""});
                        }),
                        {"--estimator", "'fliter'", "nearest is 'filter'"}));
}

}  // namespace
}  // namespace depthservo
