#pragma once

#include "depthservo/scenario/Scenario.h"

namespace depthservo {

/// What no single key can tell: the checks of each room, and what only holds between them.
void checkTogether(const Scenario& scenario, const Refuse& refuse);

}  // namespace depthservo
