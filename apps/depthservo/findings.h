#pragma once

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Prints what a run or replay found out about its sensors, if anything, on stderr.
void printFindings(const RunLog& log);

}  // namespace depthservo
