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
  f.section({"expect", "makes the run a regression test"}, s.expect,
            [](detail::Fields& fields, Scenario::Expect& expected) {
              fields.choice({"outcome", "what the run must end with; exit code 0 or 1", kRequired},
                            expected.outcome, outcomes());
            });
}

}  // namespace depthservo
