#include "depthservo/robots/RobotOptions.h"

namespace depthservo {
namespace {

void checkPose(const RobotPose& pose, RobotKind robot, const char* key, const Refuse& refuse) {
  const bool isFree = robot == RobotKind::free;
  const bool hasFloorPose = pose.x != 0 || pose.y != 0 || pose.theta != 0;
  const bool hasCameraPose = !pose.camera.xyz.isZero() || !pose.camera.rpy.isZero();
  if (isFree && hasFloorPose) refuse(key, "a free camera is placed by xyz and rpy");
  if (!isFree && hasCameraPose) refuse(key, "xyz and rpy are for robot.type free");
  if (robot != RobotKind::panUnicycle && pose.pan != 0) {
    refuse(key, "pan is for robot.type pan-unicycle");
  }
  if (robot != RobotKind::mobileManipulator && !pose.joints.isZero()) {
    refuse(key, "joints are for robot.type mobile-manipulator");
  }
}

/// How many velocities are linear, and how many after them angular.
struct Axes {
  Eigen::Index linear, angular;
};
Axes axesOf(RobotKind robot) {
  switch (robot) {
    case RobotKind::unicycle:
      return {1, 1};
    case RobotKind::panUnicycle:
      return {1, 2};
    case RobotKind::omni:
      return {2, 1};
    case RobotKind::mobileManipulator:
      return {1, 4};
    case RobotKind::free:
      return {3, 3};
  }
  return {0, 0};
}

}  // namespace

RobotVelocityLimits velocityLimits(RobotKind robot, const RobotLimits& limits) {
  const auto [linear, angular] = axesOf(robot);
  const auto each = [&, m = linear, n = angular](double v, double w) {
    Velocities all(m + n);
    all << Velocities::Constant(m, v), Velocities::Constant(n, w);
    return all;
  };
  RobotVelocityLimits all{each(limits.v, limits.w), each(limits.dv, limits.dw),
                          each(limits.brake_v, limits.brake_w)};
  if (robot == RobotKind::panUnicycle) all.velocity[2] = limits.pan;
  if (robot == RobotKind::mobileManipulator) all.velocity.tail<3>().setConstant(limits.joints);
  return all;
}

void check(const RobotOptions& robot, const Refuse& refuse) {
  if (robot.type != RobotKind::unicycle) {
    if (robot.lag != 0) refuse("lag", "only robot.type unicycle has a lag");
    if (robot.camera_yaw != 0) refuse("camera_yaw", "only robot.type unicycle has a camera_yaw");
  }
  checkPose(robot.initial, robot.type, "initial", refuse);
  if (robot.goal) checkPose(*robot.goal, robot.type, "goal", refuse);
  if (robot.type == RobotKind::mobileManipulator && !robot.camera_offset.isZero()) {
    refuse("camera_offset", "the camera of a mobile-manipulator is at the tip of its arm");
  }
  if (robot.limits.pan_min > robot.limits.pan_max) {
    refuse("limits.pan_min", "must not be above pan_max");
  }
}

}  // namespace depthservo
