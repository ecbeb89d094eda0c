#include "scenario/checks.h"

#include <fmt/format.h>

#include "depthservo/depth/DepthGains.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "robots/makeRobot.h"
#include "text/below.h"

namespace depthservo {
namespace {

/// What a law cannot do with this robot, target or estimator.
void checkLaw(const Scenario& s, const Refuse& refuse) {
  const RobotKind robot = s.robot.type;
  const Law law = s.control.law;
  if (law == Law::task && (robot == RobotKind::unicycle || robot == RobotKind::mobileManipulator)) {
    refuse("control.law",
           "task needs a robot that can move the camera at will: pan-unicycle, omni or free");
  }
  if (law == Law::task && robot == RobotKind::panUnicycle && s.robot.pan_axis == 0) {
    refuse("robot.pan_axis", "the task law needs a pan axis that is not above the wheel axle");
  }
  if (law == Law::regulation) {
    if (s.depth.estimator != EstimatorKind::pose) {
      refuse("control.law",
             "regulation steers by the pose of the target: needs depth.estimator: pose");
    }
    if (!s.robot.goal) refuse("control.law", "regulation needs a desired pose: give robot.goal");
    if (robot != RobotKind::omni && robot != RobotKind::free) {
      refuse("control.law", "regulation needs a robot.type omni or free");
    }
  }
  if (s.control.features == FeatureKind::moments && s.target.points.size() < 3) {
    refuse("control.features",
           fmt::format("moments need 3 points or more, the target has {}", s.target.points.size()));
  }
  const auto velocities = makeRobot(s.robot, s.robot.initial)->velocityNames();
  const std::string why = objection(s.control.profile, velocities.size());
  if (!why.empty()) refuse("control.profile", why);
}

void checkGoal(const Scenario& s, const Refuse& refuse) {
  const auto& desired = s.control.desired;
  if (s.control.law == Law::profile) {
    if (s.robot.goal || !desired.empty()) {
      refuse("control.law", "profile has no goal; remove robot.goal and desired");
    }
    return;
  }
  if (s.control.taught != kTaughtAtStart && s.target.type != TargetKind::wall) {
    refuse("control.taught", "is for target.type: wall");
  }
  if (!desired.empty() && s.target.type == TargetKind::wall) {
    refuse("control.desired", "the corners of a wall have no order; give robot.goal");
  }
  if (s.robot.goal.has_value() == !desired.empty()) {
    refuse(desired.empty() ? "robot.goal" : "control.desired",
           "expected exactly one of robot.goal (a pose) and control.desired (pixels)");
  }
  if (!desired.empty() && desired.size() != s.target.points.size()) {
    refuse("control.desired", fmt::format("expected one pixel for each of the {} points, got {}",
                                          s.target.points.size(), desired.size()));
  }
  for (const auto& pixel : desired) {
    if (!s.camera.pinhole().contains(pixel.x(), pixel.y())) {
      refuse("control.desired", fmt::format("({}, {}) px lies outside the {}x{} image", pixel.x(),
                                            pixel.y(), s.camera.width, s.camera.height));
    }
  }
}

/// What the estimator needs of target and camera.
void checkEstimator(const Scenario& s, const Refuse& refuse) {
  const EstimatorOptions& depth = s.depth;
  if (depth.initial < depth.Z_min || depth.initial > depth.Z_max) {
    refuse("depth.initial", fmt::format("{} m lies outside Z_min = {} m .. Z_max = {} m",
                                        depth.initial, depth.Z_min, depth.Z_max));
  }
  if (depth.estimator == EstimatorKind::pose) {
    const auto known = s.target.dots().points;
    if (s.target.type == TargetKind::apriltag && known.empty()) {
      refuse("target.tags", "depth.estimator: pose needs to know the tags: give assumed_size");
    }
    if (const auto why = whyNoTarget(known)) {
      refuse("target.points", fmt::format("depth.estimator: pose needs more: {}", *why));
    }
  }
  if (!depth.gains.k_3) return;
  const std::string objection =
      DepthGains::objection(*depth.gains.k_3, kGainExcitation, s.camera.fastest());
  if (!objection.empty()) refuse("depth.gains.k_3", objection);
}

}  // namespace

void checkTogether(const Scenario& scenario, const Refuse& refuse) {
  check(scenario, refuse);
  check(scenario.depth, detail::below("depth", refuse));
  check(scenario.control, detail::below("control", refuse));
  checkLaw(scenario, refuse);
  checkEstimator(scenario, refuse);
  checkGoal(scenario, refuse);
}

}  // namespace depthservo
