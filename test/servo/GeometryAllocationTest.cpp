// Many geometric runs, of which the outcome alone is asked for, allocate nothing per step but what
// ViSP's own law does.

#include <gtest/gtest.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

#include <cmath>
#include <string>
#include <vector>

#include "depthservo/scenario/run.h"
#include "depthservo/visp/using.h"
#include "robots/makeRobot.h"
#include "support/AllocationCounter.h"

namespace depthservo::test {
namespace {

constexpr std::size_t kWarm = 300, kSteps = 60;  // images before, and those that count

/// Allocations of the program at each image.
class Counter : public RunWatcher {
 public:
  Counter() { counts_.reserve(kWarm + kSteps + 1); }
  bool onFrame(const RunFrame&) override {
    counts_.push_back(allocations());
    return counts_.size() <= kWarm + kSteps;
  }
  /// Per image; unknown where the run was too short.
  double perStep() const {
    if (counts_.size() <= kWarm + kSteps) return std::nan("");
    return static_cast<double>(counts_[kWarm + kSteps] - counts_[kWarm]) / kSteps;
  }

 private:
  std::vector<std::size_t> counts_;
};

double allocationsPerStep(const std::vector<std::string>& overrides) {
  std::vector<std::string> all{"sensing.source=geometry", "camera.rate=15", "odometry.rate=15",
                               "duration=40", "expect=null"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  const Scenario scenario = Scenario::load(DEPTHSERVO_DATA "/scenarios/unicycle-4dots.yaml", all);
  Counter counter;
  run(scenario, &counter, Keep::theOutcome);
  return counter.perStep();
}

/// Of computeControlLaw with four of ViSP's points on a robot.
double allocationsOfViSP(RobotKind kind) {
  vpFeaturePoint s[4], desired[4];
  vpServo task;
  for (int i = 0; i < 4; ++i) {
    const double x = i % 2 ? 0.1 : -0.1, y = i < 2 ? 0.1 : -0.1;
    s[i].buildFrom(1.1 * x + 0.02, 1.2 * y, 2);
    desired[i].buildFrom(x, y, 1);
    task.addFeature(s[i], desired[i]);
  }
  task.setServo(vpServo::EYEINHAND_L_cVe_eJe);
  task.setInteractionMatrixType(vpServo::CURRENT);
  RobotOptions options;
  options.type = kind;
  const auto robot = makeRobot(options, {});
  std::size_t before = 0;
  for (std::size_t call = 0; call <= kSteps; ++call) {
    if (call == 1) before = allocations();
    task.set_cVe(robot->cVe());
    task.set_eJe(robot->eJe());
    task.computeControlLaw();
  }
  return static_cast<double>(allocations() - before) / kSteps;
}

/// A law that goes on for long enough.
const std::vector<std::string> kSlow{"control.gain=0.1"};

std::vector<std::string> slow(std::vector<std::string> more) {
  more.insert(more.end(), kSlow.begin(), kSlow.end());
  return more;
}

TEST(GeometryAllocations, vpServo_alone_allocates) {
  EXPECT_GT(allocationsOfViSP(RobotKind::unicycle), 0) << "else there is nothing to compare with";
}

TEST(GeometryAllocations, a_step_with_vpServo_allocates_what_vpServo_does) {
  const double own = allocationsOfViSP(RobotKind::unicycle);
  for (const char* estimator : {"filter", "joint", "nonlinear", "constant", "true"}) {
    EXPECT_EQ(allocationsPerStep(slow({std::string("depth.estimator=") + estimator})), own)
        << estimator;
  }
  EXPECT_EQ(allocationsPerStep(
                slow({"sensing.latency=0.05", "sensing.delay=0.1", "sensing.pixel_noise=0.2",
                      "sensing.outliers=0.05", "camera.jitter=0.2", "camera.dropped=0.1",
                      "odometry.noise=[0.003, 0.003]"})),
            own)
      << "a poor camera and odometry";
  EXPECT_EQ(allocationsPerStep(slow({"depth.errors=typical", "odometry.rate=50",
                                     "odometry.rows=mean-before", "robot.dead_time=0.1"})),
            own)
      << "typical errors, rows between images, late drives";
}

TEST(GeometryAllocations, other_robots_do_not_allocate_either) {
  for (const auto& [name, kind] :
       {std::pair{"omni", RobotKind::omni}, std::pair{"pan-unicycle", RobotKind::panUnicycle}}) {
    EXPECT_EQ(allocationsPerStep(slow({std::string("robot.type=") + name})),
              allocationsOfViSP(kind))
        << name;
  }
}

TEST(GeometryAllocations, a_step_with_a_law_of_ours_allocates_nothing) {
  EXPECT_EQ(allocationsPerStep(slow({"control.law=task", "robot.type=omni"})), 0) << "task";
  EXPECT_EQ(allocationsPerStep({"control.law=profile", "control.desired=null", "robot.goal=null",
                                "control.profile=[{until: 40, v: [0.03, 0.0]}]"}),
            0)
      << "profile";
  EXPECT_EQ(allocationsPerStep({"control.law=regulation", "depth.estimator=pose", "robot.type=omni",
                                "control.kc=0.1"}),
            0)
      << "regulation";
}

}  // namespace
}  // namespace depthservo::test
