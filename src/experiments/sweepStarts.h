#pragma once

#include <optional>
#include <string>
#include <vector>

#include "depthservo/experiments/Sweep.h"

namespace depthservo {

/// Where a robot starts, as seen from the target: an angle of zero is straight ahead of its front.
struct SweepStart {
  double distance = 0;   ///< of the camera from the middle of the points [m]
  double bearing = 0;    ///< about the vertical, counter-clockwise from above [rad]
  double elevation = 0;  ///< upwards (robot free) [rad]
  double aim = 0;        ///< of the optical axis off the middle, to the left [rad]
  double roll = 0;       ///< about the optical axis (robot free) [rad]
};

/// Takes the settings "start.*=value" out of the others. \param file for messages \throw InputError
std::optional<SweepStart> takeStart(std::vector<std::string>& settings, const std::string& file);

/// The same as settings.
std::vector<std::string> settingsOf(const SweepStart& start);

/// The pose of the scenario's robot there; arms and platforms are as in `robot.initial`. On the
/// floor the distance is that on the floor. \throw InputError this robot cannot
RobotPose poseAt(const Scenario& scenario, const SweepStart& start);

/// Whether all points are in the image from the pose, and so far from its border [px].
bool seesTarget(const Scenario& scenario, const RobotPose& pose, double margin_px);

/// A start of the cone from which the target is seen; none: of many, none was. \param text that
/// makes it
std::optional<SweepStart> drawStart(const Scenario& scenario, const SweepCone& cone, const std::string& text);

}  // namespace depthservo
