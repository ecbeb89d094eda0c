#include "depthservo/scenario/RobotFile.h"
#include "robots/makeRobot.h"
#include "scenario/FieldReader.h"
#include "scenario/keys.h"
#include "text/below.h"

namespace depthservo {

using detail::Fields;
using detail::Key;
using detail::kRequired;
using detail::Need;
using detail::Range;

namespace {

void describe(Fields& f, RobotPose& pose, RobotKind robot) {
  const bool isFree = robot == RobotKind::free;
  const Need onFloor = Need::requiredFor(!isFree, "robots other than free");
  f.number({"x", "of the middle of the wheel axle", onFloor}, pose.x, ranges::kPosition, "m");
  f.number({"y", "of the middle of the wheel axle", onFloor}, pose.y, ranges::kPosition, "m");
  f.number({"theta", "from world x to the robot's x, counter-clockwise from above", onFloor},
           pose.theta, ranges::kAngle, "rad");
  f.number({"pan", "angle of the platform, counter-clockwise (pan-unicycle)"}, pose.pan,
           ranges::kAngle, "rad");
  f.numbers({"joints",
             "of the column (counter-clockwise), of the upper arm above the horizontal, of the "
             "forearm above the upper arm (mobile-manipulator)"},
            pose.joints, ranges::kAngle, "rad");
  depthservo::describe(f, pose.camera, Need::requiredFor(isFree, "robot.type: free"));
}

void describe(Fields& f, ArmOptions& arm) {
  f.numbers({"mount", "foot of the column in the robot frame"}, arm.mount, {-10, 10}, "m");
  f.number({"column", "its height"}, arm.column, {0, 10}, "m");
  f.number({"upper_arm", "its length"}, arm.upper_arm, {0, 10}, "m");
  f.number({"forearm", "its length; the camera at its tip looks along it"}, arm.forearm, {0, 10},
           "m");
}

void describe(Fields& f, RobotLimits& limits) {
  const Range speed = Range::above(0, 1000), rate = speed, acceleration = speed;
  f.number({"v", "linear velocity, of each axis"}, limits.v, speed, "m/s");
  f.number({"w", "angular velocity"}, limits.w, rate, "rad/s");
  f.number({"dv", "linear acceleration"}, limits.dv, acceleration, "m/s^2");
  f.number({"dw", "angular acceleration"}, limits.dw, acceleration, "rad/s^2");
  f.number({"brake_v", "linear deceleration when safety stops the robot (servo, robot)"},
           limits.brake_v, acceleration, "m/s^2");
  f.number({"brake_w", "angular deceleration then"}, limits.brake_w, acceleration, "rad/s^2");
  f.number({"pan", "rate of the pan platform"}, limits.pan, rate, "rad/s");
  f.number({"joints", "rate of each joint of the arm"}, limits.joints, rate, "rad/s");
  f.number({"pan_min", "end stop of the pan platform"}, limits.pan_min, {-100, 100}, "rad");
  f.number({"pan_max", "its other end stop, not below pan_min"}, limits.pan_max, {-100, 100},
           "rad");
}

void describeCamera(Fields& f, RobotOptions& robot) {
  f.choice({"type", "see the table of robots in doc/formats.md", kRequired}, robot.type,
           robotWords());
  f.numbers({"camera_offset",
             "position of the camera in the robot frame; of a pan-unicycle: in the frame of its "
             "platform"},
            robot.camera_offset, {-10, 10}, "m");
  f.number(
      {"camera_yaw", "direction of the horizontal optical axis, from robot x towards y (unicycle)"},
      robot.camera_yaw, ranges::kAngle, "rad");
}

void describeAxes(Fields& f, RobotOptions& robot) {
  f.number({"pan_axis", "how far the pan axis lies ahead of the wheel axle (pan-unicycle)"},
           robot.pan_axis, {-10, 10}, "m");
  f.section({"arm", "of a mobile-manipulator"}, [&](Fields& arm) { describe(arm, robot.arm); });
}

void describeLimits(Fields& f, RobotOptions& robot) {
  f.section({"limits",
             "of speed and acceleration; all velocities are reduced by a common factor. Simulated, "
             "omni, mobile-manipulator and free have no limits of acceleration"},
            [&](Fields& limits) { describe(limits, robot.limits); });
}

void describe(Fields& f, SafetyOptions& safety) {
  const Range deadline = Range::above(0, 60);
  f.number({"image_age", "since the newest image that shows something new was taken"},
           safety.image_age, deadline, "s");
  f.number({"odometry_age", "since the newest row of odometry"}, safety.odometry_age, deadline,
           "s");
  f.number({"track_age", "since half of the points were last measured"}, safety.track_age,
           Range::above(0, 3600), "s");
  f.number({"contradiction",
            "more than half of the points contradict the motion for so long; then all must be "
            "found again"},
           safety.contradiction, deadline, "s");
  f.number({"overrun", "the loop has been busy with one image for so long"}, safety.overrun,
           deadline, "s");
  f.number({"unread", "commands have not been read for so long"}, safety.unread, deadline, "s");
  f.number({"calm", "a robot that was stopped goes on after so long without a cause"}, safety.calm,
           {0, 60}, "s");
  f.number({"give_up", "a cause that holds the robot for longer ends the run, exit code 4"},
           safety.give_up, Range::above(0, 3600), "s");
}

}  // namespace

void describe(Fields& f, RobotOptions& robot) {
  describeCamera(f, robot);
  f.numbers({"mount_error",
             "roll, pitch, yaw of the true camera in the frame of the camera assumed, Rz(yaw) "
             "Ry(pitch) Rx(roll); simulated error, the estimator is not informed"},
            robot.mount_error, {-0.5, 0.5}, "rad");
  f.number(
      {"mount_drawn", "1 sigma of each angle of what the seed draws and adds to `mount_error`"},
      robot.mount_drawn, {0, 0.1}, "rad");
  describeAxes(f, robot);
  f.section({"initial", "pose at the start", kRequired},
            [&](Fields& pose) { describe(pose, robot.initial, robot.type); });
  f.section({"goal",
             "pose from which the target is seen as desired; this or `control.desired`, exactly "
             "one (the law profile has none)"},
            robot.goal, [&](Fields& pose, RobotPose& goal) { describe(pose, goal, robot.type); });
  describeLimits(f, robot);
  f.number({"lag", "time constant of the drives, first order (unicycle); 0: none"}, robot.lag,
           {0, 5}, "s");
  f.number(
      {"dead_time",
       "commands take effect so much later, when a row of odometry begins or an image is taken"},
      robot.dead_time, {0, 2}, "s");
  f.list({"stuck", "times `[from, to]` in which the drives follow no command, and the robot stops"},
         robot.stuck, [](Fields& item, Interlude& span) { describe(item, span); }, {"from", "to"});
}

void describe(Fields& f, RobotFile& file) {
  describeCamera(f, file.robot);
  describeAxes(f, file.robot);
  describeLimits(f, file.robot);
  f.section({"safety", "when the robot is stopped (doc/servo.md)"},
            [&](Fields& safety) { describe(safety, file.safety); });
  f.section({"control", "how the robot is steered; without `desired`, `taught` and `profile`"},
            [&](Fields& control) { describe(control, file.control); });
}

RobotFile readRobotFile(const std::string& path) {
  RobotFile file;
  const detail::YamlValue root = detail::loadYaml(path);
  detail::FieldReader(root, path, "", [&](Fields& fields) { describe(fields, file); });
  const Refuse refuse = [&](const std::string& key, const std::string& message) {
    throw InputError({path, 0, key}, message);
  };
  check(file.robot, refuse);
  if (file.robot.type == RobotKind::panUnicycle ||
      file.robot.type == RobotKind::mobileManipulator) {
    refuse("type", "where its joints are is not known to servo; expected unicycle, omni or free");
  }
  check(file.control, detail::below("control", refuse));
  if (file.control.law != Law::vpServo && file.control.law != Law::task) {
    refuse("control.law", "a robot is steered to a taught goal by vpServo or task");
  }
  if (!file.control.desired.empty()) refuse("control.desired", "the goal is taught: remove it");
  if (file.control.taught != kTaughtAtStart)
    refuse("control.taught", "the goal is that of --goal: remove it");
  return file;
}

}  // namespace depthservo
