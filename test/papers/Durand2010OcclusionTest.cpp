#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "depthservo/scenario/run.h"
#include "papers/Durand2010.h"
#include "support/predictionError.h"

namespace depthservo {
namespace {

using durand2010::ImageRun;
using durand2010::runThroughImages;

Scenario durand(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return Scenario::load(std::string(DEPTHSERVO_DATA) + "/scenarios/durand2010/" + name + ".yaml",
                        overrides);
}

class DurandScenario : public testing::TestWithParam<const char*> {};

TEST_P(DurandScenario, ends_as_it_expects) {
  const Scenario scenario = durand(GetParam());
  const RunLog log = run(scenario);
  EXPECT_EQ(log.outcome, scenario.expect->outcome) << log.reason;
}
INSTANTIATE_TEST_SUITE_P(Files, DurandScenario,
                         testing::Values("perfect", "noise", "occlusion", "long-occlusion",
                                         "no-depth"));

TEST(DurandScenarioFile, is_what_the_program_runs) {
  EXPECT_EQ(durand("noise").toJson(), durand2010::imageScenario().toJson());
}

TEST(Occlusion, of_two_seconds_leaves_the_features_within_3_px) {
  double squares = 0;
  for (const char* seed : {"seed=1", "seed=2", "seed=3"}) {
    const RunLog log = run(durand("occlusion", {seed}));
    EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
    squares += std::pow(test::predictionError_px(log), 2) / 3;
  }
  EXPECT_LT(std::sqrt(squares), 3);
}

TEST(Occlusion, of_thirteen_seconds_leaves_the_camera_near_its_goal) {
  const ImageRun run = runThroughImages(durand("long-occlusion"));
  const Eigen::Vector3d at = run.wMc[200].translation();
  EXPECT_LT(std::hypot(at.x() - 1, at.y()), 0.37);  // the worst of 200 seeds on exact geometry
  EXPECT_EQ(run.log.outcome, Outcome::converged) << run.log.reason;
}

TEST(Occlusion, without_any_depth_ends_in_a_named_failure_far_from_the_target) {
  const ImageRun run = runThroughImages(durand("no-depth"));
  EXPECT_EQ(run.log.outcome, Outcome::leftImage);
  double nearest = HUGE_VAL;
  for (const FrameRecord& frame : run.log.frames) {
    for (const FeatureRecord& f : frame.features) nearest = std::min(nearest, f.Z_true);
  }
  EXPECT_GT(nearest, 0.5);
}

}  // namespace
}  // namespace depthservo
