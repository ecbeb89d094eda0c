#pragma once

#include "depthservo/papers/Reproduce.h"
#include "papers/Claims.h"

/// The experiments of De Luca, Oriolo, Robuffo Giordano 2008 by section, one file each.
/// Figures in the order of the paper.
namespace depthservo::deluca2008 {

/// Section 5.1: depth of a point in the numerical example.
void addDepthExperiments(Experiments& r, const ReproduceOptions& options);

/// Section 5.1: depth of a point seen by a camera on an arm, with noise in the image.
void addArmExperiments(Experiments& r, const ReproduceOptions& options);

/// Sections 5.2 and 7.1: focal length of a turning camera, in the numerical example and on the
/// unicycle.
void addFocalExperiments(Experiments& r, const ReproduceOptions& options);

/// Sections 7.2 and 7.3: a unicycle drives to where it sees four points, or their moments, as
/// desired, from wrong guesses of their depth. `full`: all starts through images too.
void addServoExperiments(Experiments& r, const ReproduceOptions& options);

}  // namespace depthservo::deluca2008
