#include "depthservo/experiments/expectation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

bool isAtRest(const RunLog& log) {
  return !log.frames.empty() && log.frames.back().command.isZero(0);
}

}  // namespace

std::vector<std::string> unmet(const Scenario& scenario, const RunLog& log,
                               const Metrics& metrics) {
  using Cause = ConsistencyMonitor::Cause;
  std::vector<std::string> all;
  if (!scenario.expect) return all;
  const Scenario::Expect& expected = *scenario.expect;
  const auto differs = [&](const std::string& should, const std::string& is) {
    all.push_back(fmt::format("expected {}, got {}", should, is));
  };
  if (log.outcome != expected.outcome) differs(toString(expected.outcome), toString(log.outcome));
  if (expected.coverage && metrics.coverage_2sigma < *expected.coverage) {
    differs(fmt::format("coverage of {:g} at least", *expected.coverage),
            fmt::format("{:.3f}", metrics.coverage_2sigma));
  }
  const auto valid =
      std::count_if(metrics.points.begin(), metrics.points.end(),
                    [](const PointMetrics& point) { return point.status == DepthStatus::valid; });
  if (expected.valid && (static_cast<double>(valid) < (*expected.valid)[0] ||
                         static_cast<double>(valid) > (*expected.valid)[1])) {
    differs(fmt::format("{:g} to {:g} valid depths", (*expected.valid)[0], (*expected.valid)[1]),
            fmt::format("{}", valid));
  }
  const Cause cause =
      log.diagnosis && log.diagnosis->isFault() ? log.diagnosis->latest.cause : Cause::none;
  if (expected.diagnosis && cause != *expected.diagnosis) {
    differs(fmt::format("diagnosis {}", ConsistencyMonitor::toString(*expected.diagnosis)),
            ConsistencyMonitor::toString(cause));
  }
  if (expected.at_rest && !isAtRest(log)) differs("a last command of zero", "another");
  return all;
}

}  // namespace depthservo
