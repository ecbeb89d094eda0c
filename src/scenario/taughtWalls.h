#pragma once

#include "depthservo/scenario/Scenario.h"
#include "depthservo/servo/TaughtGoal.h"

namespace depthservo {

/// A run before textured walls: what is taught, and the same robot with the taught corners as the
/// points of its target, where they truly are.
struct TaughtWalls {
  SimulatedRigOptions rig;
  TaughtGoal goal;
};

/// \throw InputError no goal, or it is not seen from the start
TaughtWalls teachWalls(const Scenario& scenario);

}  // namespace depthservo
