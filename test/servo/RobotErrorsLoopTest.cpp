// The loop closed on unicycles with everyday errors, from random starts and with any guess, by
// depths observed with the profile `typical` and by true ones. DEPTHSERVO_STARTS: how many (20).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "depthservo/scenario/run.h"
#include "motion/median.h"
#include "support/Random.h"

namespace depthservo {
namespace {

struct Ends {
  int arrived = 0;
  double median_s = 0;
};

std::string set(const std::string& key, double value) { return key + "=" + std::to_string(value); }

Ends ofAll(const std::string& estimator, unsigned starts) {
  Ends ends;
  std::vector<double> times;
  for (unsigned seed = 1; seed <= starts; ++seed) {
    test::Random random(seed);
    const double x = random.uniform(-4.5, -2.5), y = random.uniform(-.8, .8);
    const double theta = std::atan2(-y, -x) + random.uniform(-.2, .2);
    const double guess = -x * std::pow(4, random.uniform(-1, 1));
    const RunLog log = run(Scenario::load(
        DEPTHSERVO_DATA "/scenarios/unicycle-4dots.yaml",
        {"seed=" + std::to_string(seed), set("robot.initial.x", x), set("robot.initial.y", y),
         set("robot.initial.theta", theta), set("depth.initial", guess),
         "depth.estimator=" + estimator, "depth.errors=typical", "control.tolerance=4",
         "sensing.source=geometry", "sensing.pixel_noise=0.2", "sensing.latency=0.012",
         "sensing.stamp_jitter=0.002", "sensing.wander.sigma=0.15", "camera.focal_drawn=0.003",
         "robot.mount_drawn=0.007", "odometry.scale_drawn=0.01", "odometry.slip.sigma=0.02",
         "odometry.gyro_bias_drawn=0.004", "odometry.gyro_noise=0.002"}));
    if (log.outcome != Outcome::converged) continue;
    ++ends.arrived;
    times.push_back(log.frames.back().time_s);
  }
  if (!times.empty()) ends.median_s = detail::medianOf(times);
  return ends;
}

class RobotErrorsLoop : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Estimators, RobotErrorsLoop, testing::Values("filter", "joint"));

TEST_P(RobotErrorsLoop, arrives_as_often_and_as_soon_as_with_true_depths) {
  const char* const asked = std::getenv("DEPTHSERVO_STARTS");
  const auto starts = static_cast<unsigned>(asked ? std::atoi(asked) : 20);
  const Ends known = ofAll("true", starts), observed = ofAll(GetParam(), starts);
  std::printf("%s: %d of %u arrive, median %.2f s; with true depths %d, %.2f s\n", GetParam(),
              observed.arrived, starts, observed.median_s, known.arrived, known.median_s);
  EXPECT_GE(observed.arrived, known.arrived);
  EXPECT_NEAR(observed.median_s, known.median_s, .05 * known.median_s);
}

}  // namespace
}  // namespace depthservo
