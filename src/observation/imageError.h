#pragma once

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// As meanImageError, less what noise may make of each mean position: so many times its standard
/// error, 0 and more; 0 gives meanImageError itself.
double imageErrorBeyondNoise(const RunLog& log, double from_s, double to_s, double standardErrors);

}  // namespace depthservo
