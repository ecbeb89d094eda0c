#pragma once

#include <string>
#include <vector>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// Odometry as it would be if a usual mistake had been made.
struct MotionSuspect {
  ConsistencyMonitor::Cause cause;  ///< frame, clock, unit or poseConvention
  double size = 0;                  ///< see Cause
  std::string what;                 ///< "the twists are in robot axes (x forward, y left, z up)"
  std::vector<OdometryRow> rows;
};

/// The usual mistakes with twists: axes, signs, order of the columns, degrees.
std::vector<MotionSuspect> suspectTwists(const std::vector<OdometryRow>& rows);

/// The usual mistakes with poses: inverted, w before x, axes of a robot or of OpenGL.
std::vector<MotionSuspect> suspectPoses(const std::vector<CameraPose>& poses);

/// Where the motion does not explain the images of a log at all: tries each suspect and clocks that
/// are apart by up to two seconds, and names the one that explains them, with its evidence. Does
/// nothing otherwise.
void explainMotion(RunLog& log, const ObservationOptions& options,
                   const std::vector<OdometryRow>& rows,
                   const std::vector<MotionSuspect>& suspects);

}  // namespace depthservo
