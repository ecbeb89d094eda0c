#pragma once

#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/Scenario.h"

namespace depthservo {

/// What a run was expected to be and was not, each as "expected <this>, got <that>"; empty: all of
/// `expect` is met, or there is none.
std::vector<std::string> unmet(const Scenario& scenario, const RunLog& log, const Metrics& metrics);

}  // namespace depthservo
