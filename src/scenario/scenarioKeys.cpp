#include "scenario/keys.h"

namespace depthservo {
namespace {

std::vector<detail::Choice<Outcome>> outcomes() {
  std::vector<detail::Choice<Outcome>> all;
  for (const Outcome outcome :
       {Outcome::converged, Outcome::stalled, Outcome::leftImage, Outcome::lost, Outcome::diverged,
        Outcome::collision, Outcome::timeout}) {
    all.push_back({outcome, toString(outcome)});
  }
  return all;
}

std::vector<detail::Choice<std::optional<ConsistencyMonitor::Cause>>> causes() {
  std::vector<detail::Choice<std::optional<ConsistencyMonitor::Cause>>> all{{std::nullopt, "any"}};
  for (int i = 0; i <= static_cast<int>(ConsistencyMonitor::Cause::noData); ++i) {
    const auto cause = static_cast<ConsistencyMonitor::Cause>(i);
    all.push_back({cause, ConsistencyMonitor::toString(cause)});
  }
  return all;
}

void describe(detail::Fields& f, Scenario::Expect& e) {
  f.choice({"outcome", "what the run must end with; exit code 0 or 1", detail::kRequired},
           e.outcome, outcomes());
  f.number({"coverage", "share of the depths claimed (converging or valid) whose inverse is within "
                        "2 sigma of the true one, at least; met where none is claimed"},
           e.coverage, {0, 1}, "");
  f.numbers({"valid", "number of points whose depth is valid at the end: [at least, at most]"},
            e.valid, {0, 1000}, "");
  f.choice({"diagnosis", "cause that must be named at the end; none: no fault"}, e.diagnosis,
           causes());
  f.flag({"at_rest", "whether the last command must be zero"}, e.at_rest);
}

}  // namespace

void describe(detail::Fields& f, Scenario& s) {
  using detail::kRequired;
  const auto section = [&](const detail::Key& key, auto& part) {
    f.section(key, [&](detail::Fields& fields) { describe(fields, part); });
  };
  f.text({"name", "name in logs and reports", kRequired}, s.name);
  f.integer({"seed", "of all noise; the same seed gives the same bytes"}, s.seed, {0, 4294967295.0},
            "");
  f.number({"duration", "the run ends with `timeout` after it", kRequired}, s.duration,
           ranges::kDuration, "s");
  section({"camera", "intrinsic parameters, without distortion, and the clock", kRequired},
          s.camera);
  section({"target", "the plate that the camera looks at", kRequired}, s.target);
  section({"robot", "what carries the camera", kRequired}, s.robot);
  s.sensing.tracker = s.target.type;
  section({"sensing", "how the points are measured"}, s.sensing);
  section({"odometry", "what the estimator is told of the camera's motion"}, s.odometry);
  section({"depth", "how depth is observed", kRequired}, s.depth);
  section({"control", "how the robot is steered"}, s.control);
  f.section({"expect", "makes the run a regression test: all of it must be met"}, s.expect,
            [](detail::Fields& fields, Scenario::Expect& expected) { describe(fields, expected); });
}

}  // namespace depthservo
