#include "robots/makeRobot.h"

#include <stdexcept>

#include "depthservo/robots/FreeCamera.h"
#include "depthservo/robots/MobileManipulator.h"
#include "depthservo/robots/OmniBase.h"
#include "depthservo/robots/PanUnicycle.h"
#include "depthservo/robots/UnicycleCamera.h"

namespace depthservo {

const std::vector<detail::Choice<RobotKind>>& robotWords() {
  static const std::vector<detail::Choice<RobotKind>> all = {
      {RobotKind::unicycle, "unicycle"},
      {RobotKind::panUnicycle, "pan-unicycle"},
      {RobotKind::omni, "omni"},
      {RobotKind::mobileManipulator, "mobile-manipulator"},
      {RobotKind::free, "free"}};
  return all;
}

std::unique_ptr<SimulatedRobot> makeRobot(const RobotOptions& robot, const RobotPose& pose) {
  const RobotLimits& limits = robot.limits;
  switch (robot.type) {
    case RobotKind::unicycle: {
      auto unicycle = std::make_unique<UnicycleCamera>(robot.camera_offset, robot.camera_yaw);
      unicycle->setPose({pose.x, pose.y, pose.theta});
      unicycle->setLimits({limits.v, limits.w, limits.dv, limits.dw});
      unicycle->setLag(robot.lag);
      return unicycle;
    }
    case RobotKind::panUnicycle: {
      const Eigen::Vector3d& camera = robot.camera_offset;
      auto pan = std::make_unique<PanUnicycle>(
          PanUnicycle::Geometry{robot.pan_axis, camera.x(), camera.y(), camera.z()});
      pan->setState({pose.x, pose.y, pose.theta, pose.pan});
      PanUnicycleLimits panLimits;
      panLimits.velocity << limits.v, limits.w, limits.pan;
      panLimits.acceleration << limits.dv, limits.dw, limits.dw;
      panLimits.pan_min = limits.pan_min;
      panLimits.pan_max = limits.pan_max;
      pan->setLimits(panLimits);
      return pan;
    }
    case RobotKind::omni: {
      auto omni = std::make_unique<OmniBase>(robot.camera_offset);
      omni->setPose({pose.x, pose.y, pose.theta});
      omni->setLimits({limits.v, limits.v, limits.w});
      return omni;
    }
    case RobotKind::mobileManipulator: {
      auto manipulator = std::make_unique<MobileManipulator>(MobileManipulator::Geometry{
          robot.arm.mount, robot.arm.column, robot.arm.upper_arm, robot.arm.forearm});
      manipulator->setState({pose.x, pose.y, pose.theta, pose.joints});
      MobileManipulator::Vector5d velocities;
      velocities << limits.v, limits.w, Eigen::Vector3d::Constant(limits.joints);
      manipulator->setLimits(velocities);
      return manipulator;
    }
    case RobotKind::free: {
      auto camera = std::make_unique<FreeCamera>(pose.camera.isometry());
      camera->setLimits(limits.v, limits.w);
      return camera;
    }
  }
  throw std::logic_error("no such robot");
}

}  // namespace depthservo
