#pragma once

#include <string>
#include <vector>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// Where the motion does not explain the images of a log at all: tries the usual mistakes with
/// twists (axes, signs, order of the columns, degrees) and clocks that are apart by up to two
/// seconds, and names the one that explains them, with its evidence. Does nothing otherwise.
void explainMotion(RunLog& log, const ObservationOptions& options,
                   const std::vector<OdometryRow>& rows);

/// The same with those of poses: inverted, w before x, axes of a robot or of OpenGL.
void explainMotion(RunLog& log, const ObservationOptions& options,
                   const std::vector<CameraPose>& poses);

}  // namespace depthservo
