#include "depthservo/scenario/recordedLaw.h"

#include <filesystem>

#include "depthservo/text/InputError.h"
#include "robots/makeRobot.h"
#include "scenario/keys.h"
#include "text/KeyTree.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
constexpr const char *kCommands = "commands.csv", *kRobot = "robot.yaml", *kGoal = "goal";

ServoGoal goalIn(const std::string& folder) {
  const Sequence sequence(folder);
  ServoGoal goal;
  for (const PixelPoint& point : sequence.frames().front().tracks) {
    goal.pixels.emplace_back(point.u, point.v);
  }
  for (const TrueDepth& depth : sequence.frames().front().truth) goal.Z.push_back(depth.Z);
  if (goal.pixels.empty() || goal.Z.size() != goal.pixels.size()) {
    throw InputError({folder, 0, ""}, "expected tracks.csv and truth.csv with the same points");
  }
  return goal;
}

}  // namespace

void chooseLaw(RobotFile& robot, const std::string& law) {
  if (law == "task") robot.control.law = Law::task;
  if (law == "vpServo") robot.control.law = Law::vpServo;
  if (robot.control.law != Law::task || robot.robot.type != RobotKind::unicycle) return;
  throw InputError({law.empty() ? "control.law" : "--law", 0, ""},
                   "task needs a robot that can move the camera at will: omni or free");
}

void addLaw(SequenceSettings& settings, const RobotFile& robot, const ServoGoal& goal) {
  RobotFile file = robot;
  file.control.desired.clear();  // the goal has them
  file.control.taught = kTaughtAtStart;
  const auto keys = detail::keyTree([&](detail::Fields& f) { describe(f, file); });
  settings.robot = detail::toJson(keys).dump(2) + '\n';
  for (std::size_t i = 0; i < goal.pixels.size(); ++i) {
    settings.goal.push_back({static_cast<int>(i), goal.pixels[i].x(), goal.pixels[i].y()});
  }
  settings.goalZ = goal.Z;
}

RecordedLaw readLaw(const std::string& folder, const std::string& law) {
  const fs::path place(folder);
  for (const char* name : {kCommands, kRobot, kGoal}) {
    if (fs::exists(place / name)) continue;
    throw InputError({folder, 0, ""},
                     std::string("has no ") + name +
                         ": --law needs a recording of servo --record, or of record with the law "
                         "vpServo or task, without control.excite, of a robot without joints");
  }
  RobotFile file = readRobotFile(place / kRobot);
  chooseLaw(file, law);
  RecordedLaw recorded{file.robot, file.control, goalIn(place / kGoal), {}};
  const auto names = makeRobot(file.robot, file.robot.initial)->velocityNames();
  recorded.commands = readLawCommands(place / kCommands, names);
  return recorded;
}

}  // namespace depthservo
