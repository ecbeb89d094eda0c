#pragma once

#include <optional>
#include <string>
#include <vector>

#include "depthservo/report/Metrics.h"

namespace depthservo {

/// The figures of a run that a sweep can keep, by the names that run.json has for them.
const std::vector<std::string>& sweepMetricNames();
using SweepMetric = double (*)(const Metrics&);
std::optional<SweepMetric> sweepMetric(const std::string& name);

/// `refused` beside the outcomes of a run: it could not begin.
constexpr const char* kRefused = "refused";
const std::vector<std::string>& outcomeNames();
bool outcomeNamed(const std::string& name);

}  // namespace depthservo
