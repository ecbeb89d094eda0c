#include <gtest/gtest.h>

#include "depthservo/experiments/expectation.h"

namespace depthservo {
namespace {

/// A run that met all that is asked below.
struct Met {
  Met() {
    scenario.expect.emplace();
    scenario.expect->outcome = log.outcome = Outcome::lost;
    scenario.expect->coverage = 0.9;
    scenario.expect->valid = Eigen::Vector2d(1, 2);
    scenario.expect->diagnosis = ConsistencyMonitor::Cause::none;
    scenario.expect->at_rest = true;
    metrics.coverage_2sigma = 0.9;
    metrics.points.resize(3);
    metrics.points[1].status = DepthStatus::valid;
    log.frames.resize(1);
    log.frames.back().command = Eigen::Vector2d(0, 0);
  }
  std::vector<std::string> differences() const { return unmet(scenario, log, metrics); }

  Scenario scenario;
  RunLog log;
  Metrics metrics;
};

TEST(Expectation, is_met_by_what_was_asked_and_by_anything_where_nothing_is) {
  Met run;
  EXPECT_TRUE(run.differences().empty());
  run.metrics.coverage_2sigma = kUnknown;  // nothing was claimed
  EXPECT_TRUE(run.differences().empty());
  run.scenario.expect.reset();
  run.log.outcome = Outcome::diverged;
  EXPECT_TRUE(run.differences().empty());
}

TEST(Expectation, tells_each_thing_that_is_otherwise) {
  const auto only = [](const auto& change) {
    Met run;
    change(run);
    const auto differences = run.differences();
    return differences.size() == 1 ? differences[0] : std::to_string(differences.size());
  };
  EXPECT_EQ(only([](Met& r) { r.log.outcome = Outcome::timeout; }), "expected lost, got timeout");
  EXPECT_EQ(only([](Met& r) { r.metrics.coverage_2sigma = 0.89; }),
            "expected coverage of 0.9 at least, got 0.890");
  EXPECT_EQ(only([](Met& r) { r.metrics.points.clear(); }), "expected 1 to 2 valid depths, got 0");
  EXPECT_EQ(only([](Met& r) { r.log.frames.back().command[1] = 1e-9; }),
            "expected a last command of zero, got another");
  EXPECT_EQ(only([](Met& r) { r.log.frames.clear(); }),
            "expected a last command of zero, got another");
  EXPECT_EQ(only([](Met& r) {
              r.log.diagnosis.emplace();
              r.log.diagnosis->first_s = 1;
              r.log.diagnosis->latest.cause = ConsistencyMonitor::Cause::latency;
            }),
            "expected diagnosis none, got latency");
}

}  // namespace
}  // namespace depthservo
