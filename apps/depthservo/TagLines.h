#pragma once

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Tells on stderr what sizes of AprilTags were observed, and which disagree with the sizes given.
void printTags(const RunLog& log);

}  // namespace depthservo
