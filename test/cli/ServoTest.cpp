// A goal is shown, a robot returns to it: two processes in lockstep, the same every time.

#include <gtest/gtest.h>

#include <cmath>

#include "cli/RobotPair.h"

namespace depthservo::test {
namespace {

std::string served(const std::string& name, const std::string& more = "") {
  return data("servo/" + name + ".yaml") + " --set duration=40 " + more;
}

const std::string kOmni =
    "type: omni\ncamera_offset: [0.07, 0.02, 0.13]\n"
    "limits: {v: 0.5, w: 1, dv: 1, dw: 2}\ncontrol: {tolerance: 2}\n";

struct Task {
  const char* name;
  std::string scenario, goalPose, teach, robot;
  bool isExact;  ///< the robot can reach the goal itself, not only its image
};

class TeachAndReturn : public testing::TestWithParam<Task> {};

TEST_P(TeachAndReturn, converges) {
  const Task& task = GetParam();
  RobotPair pair(task.scenario);
  if (!task.robot.empty()) pair.writeRobot(task.robot);
  pair.teach(task.goalPose, task.teach);
  pair.start("--arm --prior 1", true);
  pair.wait();
  EXPECT_EQ(pair.servoExit, 0) << pair.words;
  ASSERT_FALSE(pair.robot.is_null());
  EXPECT_LT(pair.robot["goal_error_px"], 4) << pair.words;
  if (task.isExact) {
    EXPECT_NEAR(pair.robot["pose"][0], -1, 0.02) << pair.words;
    EXPECT_NEAR(pair.robot["pose"][1], 0, 0.02) << pair.words;
  }
  EXPECT_EQ(pair.written().back().v, 0) << "zero is commanded last";
}

INSTANTIATE_TEST_SUITE_P(Servo, TeachAndReturn,
                         testing::Values(Task{"unicycle_dots", served("dots"),
                                              "{x: -1, y: 0, theta: 0}", "--tracker dots", "",
                                              false},
                                         Task{"omni_tag", served("tag"), "{x: -1, y: 0, theta: 0}",
                                              "--tracker apriltag", kOmni, true}),
                         [](const auto& task) { return std::string(task.param.name); });

TEST(Servo, replay_of_its_record_gives_the_same_estimates) {
  RobotPair pair(served("dots", "--set 'robot.initial={x: -1.6, y: 0.05, theta: 0}'"));
  pair.teach("{x: -1, y: 0, theta: 0}", "--tracker dots");
  pair.start("--arm --prior 1 --record " + pair.path("record") + " --out " + pair.path("out"),
             true);
  pair.wait();
  ASSERT_EQ(pair.servoExit, 0) << pair.words;
  const Result replay =
      depthservo("replay " + pair.path("record") + " --out " + pair.path("replayed"));
  ASSERT_EQ(replay.exitCode, 0) << replay.err;
  expectSameEstimates(pair.path("out"), pair.path("replayed"), 0);

  // And the same commands, byte for byte; the other law, which this robot cannot have, is refused.
  const std::string again = "replay " + pair.path("record") + " --json --law ";
  const Result law = depthservo(again + "recorded --commands " + pair.path("again.csv"));
  ASSERT_EQ(law.exitCode, 0) << law.err;
  EXPECT_GT(law.json()["law"]["same"], 60);
  EXPECT_EQ(pair.fileText("again.csv"), pair.fileText("record/commands.csv"));
  EXPECT_NE(law.err.find("are the same to the last bit"), std::string::npos) << law.err;
  const Result constant = depthservo(again + "vpServo --estimator constant");
  EXPECT_EQ(constant.exitCode, 0) << constant.err;
  EXPECT_LT(constant.json()["law"]["same"], constant.json()["law"]["recorded"]);
  EXPECT_GT(constant.json()["law"]["greatest_difference"][0], 1e-3);
  EXPECT_EQ(depthservo(again + "recorded --estimator constant").exitCode, 1);
  expectRefused(depthservo(again + "task"), {"task"});
  expectRefused(depthservo(again + "tusk"), {"--law", "task"});
  expectRefused(depthservo("replay " + pair.path("seen") + " --law recorded --commands " +
                           pair.path("again.csv")),
                {"again.csv", "exists already"});
  std::filesystem::remove(pair.path("record/commands.csv"));
  expectRefused(depthservo(again + "recorded"), {"record", "commands.csv", "servo --record"});
}

TEST(Servo, whose_images_end_before_one_is_observed_keeps_nothing) {
  const TemporaryFolder folder;
  RobotPair pair(served("dots"));
  pair.teach("{x: -1, y: 0, theta: 0}", "--tracker dots");
  std::filesystem::create_directory(folder / "images");
  std::filesystem::copy(pair.path("seen/rgb/000001.png"), folder / "images/000001.png");
  folder.write("twists.csv", "");
  const auto path = [&](const char* name) { return (folder / name).string(); };
  const Result result = depthservo(
      "servo --goal " + pair.path("goal") + " --robot " + pair.path("robot.yaml") + " --source " +
      path("images/%06d.png") + " --fps 30 --twist " + path("twists.csv") + " --command " +
      path("commands") + " --arm --out " + path("out") + " --record " + path("record"));
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_NE(result.err.find("no image was observed: nothing is kept\n"), std::string::npos);
  EXPECT_NE(result.err.find("all 1 images read"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  EXPECT_FALSE(std::filesystem::exists(folder / "record"));
}

TEST(Servo, refuses_what_cannot_be_used_in_one_line) {
  const TemporaryFolder folder;
  RobotPair pair(served("dots"));
  pair.teach("{x: -1, y: 0, theta: 0}", "--tracker dots");
  folder.write("robot.yaml", "type: unicycle\nlimits: {v: 0.5, brake: 4}\n");
  folder.write("legs.yaml", "type: hexapod\n");
  folder.write("profile.yaml", "type: unicycle\ncontrol: {law: profile, profile: [{until: 1}]}\n");
  const std::string good = "--goal " + pair.path("goal") + " --robot " + pair.path("robot.yaml") +
                           " --twist " + (folder / "tw").string() + " --command " +
                           (folder / "co").string();
  const auto with = [&](const std::string& goal, const std::string& robot) {
    return depthservo("servo --source " + (folder / "im").string() + " --goal " + goal +
                      " --robot " + robot + " --twist - --command -");
  };
  expectRefused(depthservo("servo --source " + (folder / "im").string() + " " + good),
                {"im", "no such file"});
  expectRefused(with(folder.path(), pair.path("robot.yaml")), {folder.path(), "is not a sequence"});
  expectRefused(with(pair.path("seen"), pair.path("robot.yaml")), {"seen", "goal"});
  expectRefused(with(pair.path("goal"), folder / "none.yaml"), {"none.yaml"});
  expectRefused(with(pair.path("goal"), folder / "robot.yaml"), {"limits.brake", "brake_v"});
  expectRefused(with(pair.path("goal"), folder / "legs.yaml"), {"type", "hexapod", "unicycle"});
  folder.write("arm.yaml", "type: mobile-manipulator\n");
  expectRefused(with(pair.path("goal"), folder / "arm.yaml"), {"type", "joints", "omni"});
  expectRefused(with(pair.path("goal"), folder / "profile.yaml"), {"control.law", "vpServo"});
}

TEST(Teach, says_what_it_finds_and_how_far_it_is) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  record(served("dots", "--set duration=0.02 --set 'robot.initial={x: -1, y: 0, theta: 0}'"),
         path("seen"));
  const std::string from = "teach --source " + path("seen/rgb/000001.png") + " --camera " +
                           path("seen/camera.yaml") + " --out ";
  const Result dots = depthservo(from + path("dots") + " --tracker dots");
  EXPECT_EQ(dots.exitCode, 0) << dots.err;
  EXPECT_NE(dots.err.find("4 dots; their depths at the goal are not known"), std::string::npos);
  const Result known = depthservo(from + path("known") + " --target " + path("seen/sequence.yaml"));
  EXPECT_EQ(known.exitCode, 0) << known.err;
  const auto truth = readCsv(path("known/truth.csv"));
  ASSERT_EQ(truth.at("Z").size(), 4u);
  for (const std::string& Z : truth.at("Z")) EXPECT_NEAR(std::stod(Z), 0.93, 0.01);
  const Result told = depthservo(from + path("told") + " --tracker dots --depth 0.9");
  EXPECT_EQ(readCsv(path("told/truth.csv")).at("Z")[2], "0.9");
  expectRefused(depthservo(from + path("tags") + " --tracker apriltag"),
                {"0 of 4 corners of tags"});
  expectRefused(depthservo(from + path("dots") + " --tracker dots"), {"dots", "exists already"});
  expectRefused(depthservo("teach --source " + path("none.png") + " --camera " +
                           path("seen/camera.yaml") + " --out " + path("x")),
                {"none.png", "no such file"});
}

TEST(Robot, refuses_what_cannot_be_used_in_one_line) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  const auto robot = [&](const std::string& scenario) {
    return depthservo("robot " + scenario + " --images " + path("im") + " --twist " + path("tw") +
                      " --command " + path("co") + " --wait 0.1");
  };
  expectRefused(robot(served("dots", "--set sensing.source=geometry")), {"sensing.source"});
  expectRefused(robot("nowhere.yaml"), {"nowhere.yaml"});
  const Result alone = robot(served("dots"));
  EXPECT_EQ(alone.exitCode, 0);
  EXPECT_NE(alone.err.find("nobody reads the images"), std::string::npos) << alone.err;
  EXPECT_TRUE(folder.isEmpty()) << "the pipes that it has made are gone";
}

}  // namespace
}  // namespace depthservo::test
