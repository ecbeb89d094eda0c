// A motion across the line of sight while depths are not known: what it gains, and what it costs.
// All is measured against the same run without it, in the simulator's truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "depthservo/scenario/run.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using Overrides = std::vector<std::string>;

const std::string kApproach = DEPTHSERVO_DATA "/scenarios/free-approach.yaml";
const std::string kNearAxis = DEPTHSERVO_DATA "/scenarios/free-near-axis.yaml";
const std::string kUnicycle = DEPTHSERVO_DATA "/scenarios/unicycle-4dots.yaml";

RunLog run(const std::string& file, Overrides overrides, const Overrides& more) {
  overrides.insert(overrides.end(), more.begin(), more.end());
  overrides.emplace_back("expect=null");
  return run(Scenario::load(file, overrides));
}

std::string seeded(unsigned seed) { return "seed=" + std::to_string(seed); }

/// Frames until every depth is known to 5 %; all frames when they never are.
std::size_t framesTo5Percent(const RunLog& log) {
  const auto known = std::find_if(log.frames.begin(), log.frames.end(), [](const auto& frame) {
    return std::all_of(frame.features.begin(), frame.features.end(),
                       [](const FeatureRecord& feature) { return feature.frames_to_5pct == 0; });
  });
  return static_cast<std::size_t>(known - log.frames.begin());
}

std::size_t median(std::vector<std::size_t> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// How far apart the points of two frames are, the farthest [px].
double distance(const FrameRecord& a, const FrameRecord& b) {
  double farthest = 0;
  for (std::size_t i = 0; i < std::min(a.features.size(), b.features.size()); ++i) {
    const FeatureRecord &p = a.features[i], &q = b.features[i];
    farthest = std::max(farthest, std::hypot(p.u_true - q.u_true, p.v_true - q.v_true));
  }
  return farthest;
}

/// The farthest while the first run is excited.
double distance(const RunLog& excited, const RunLog& plain) {
  double farthest = 0, end_s = 0;
  for (const Event& event : excited.events) {
    if (event.what.rfind("active excitation", 0) != 0) continue;
    const bool isEnd = event.what.find("ended") != std::string::npos;
    end_s = isEnd ? event.time_s : HUGE_VAL;
  }
  for (std::size_t k = 0; k < std::min(excited.frames.size(), plain.frames.size()); ++k) {
    if (excited.frames[k].time_s > end_s) break;
    farthest = std::max(farthest, distance(excited.frames[k], plain.frames[k]));
  }
  return farthest;
}

/// Many runs with and without excitation.
struct Comparison {
  std::vector<std::size_t> with, without;  // frames to 5 %
  double squared = 0;                      // relative errors of Z then, with excitation
  int errors = 0, halved = 0;              // halved: at most half the frames, in the same run

  void add(const RunLog& excited, const RunLog& plain) {
    with.push_back(framesTo5Percent(excited));
    without.push_back(framesTo5Percent(plain));
    if (2 * with.back() <= without.back()) ++halved;
    ASSERT_LT(with.back(), excited.frames.size()) << "never known";
    for (const FeatureRecord& feature : excited.frames[with.back()].features) {
      squared += std::pow(feature.estimate.Z() / feature.Z_true - 1, 2);
      ++errors;
    }
  }
  double rms() const { return std::sqrt(squared / errors); }
};

Comparison compare(const std::string& file, unsigned seeds) {
  Comparison comparison;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    comparison.add(run(file, {seeded(seed)}, {}),
                   run(file, {seeded(seed)}, {"control.excite=null"}));
  }
  return comparison;
}

TEST(ActiveExcitation, halves_the_frames_to_5_percent_of_a_point_near_the_axis) {
  const Comparison runs = compare(kNearAxis, 40);
  EXPECT_EQ(runs.halved, 40);
  EXPECT_LT(runs.rms(), .05) << "of the true error";
  EXPECT_LE(median(runs.with), 30u) << "the Cramer-Rao bound is below 5 % from frame 24 on";
  const std::size_t all = run(kNearAxis, {}, {"control.excite=null"}).frames.size();
  for (const std::size_t frames : runs.without) EXPECT_LT(frames, all) << "not measured to its end";
}

TEST(ActiveExcitation, halves_the_frames_to_5_percent_of_a_task) {
  // Most runs without it end before that; their frames are then a lower bound.
  const Comparison runs = compare(kApproach, 20);
  EXPECT_EQ(runs.halved, 20);
  EXPECT_LT(runs.rms(), .05) << "of the true error";
  EXPECT_LE(median(runs.with), 50u);
}

/// A robot with what it does, and how deep its points are.
struct Case {
  const char* what;
  std::string file;
  double Z;
  Overrides overrides;
};

/// Two points before a robot that is where it should be.
Case twoPoints(const char* robot, const char* where) {
  return {robot,
          kApproach,
          2,
          {"target.points=[[-0.2, -0.1, 0], [0.2, 0.1, 0]]", "robot=null",
           std::string("robot={type: ") + robot + ", initial: " + where + ", goal: " + where + "}",
           "control.interaction=desired", "control.tolerance=0.01", "duration=6"}};
}

std::vector<Case> twoPointCases() {
  return {
      twoPoints("free", "{xyz: [-2, 0, 0.13], rpy: [-1.5707963267948966, 0, -1.5707963267948966]}"),
      twoPoints("mobile-manipulator", "{x: -2.7, y: 0, theta: 0, joints: [0, 0.6, -0.6]}")};
}

/// With `interaction: desired` the task never uses a depth, and on a given profile there is no
/// task: what differs is due to the excitation alone.
std::vector<Case> cases() {
  const auto onWheels = [](const char* type, Overrides overrides) {
    overrides.insert(overrides.end(),
                     {std::string("robot.type=") + type, "duration=12", "sensing.source=geometry",
                      "sensing.pixel_noise=0.25", "control.interaction=desired"});
    return Case{type, kUnicycle, 3.9, overrides};
  };
  std::vector<Case> all = twoPointCases();
  all.insert(all.end(),
             {{"approach", kApproach, 3.9, {"control.interaction=desired", "duration=20"}},
              {"given profile", kNearAxis, 3.9, {}},
              onWheels("unicycle", {"robot.camera_offset=[0.3, 0.1, 0.13]"}),
              onWheels("pan-unicycle", {}),
              onWheels("omni", {})});
  return all;
}

TEST(ActiveExcitation, moves_no_point_by_more_than_its_limit) {
  test::Random random(1);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const Case& one : cases()) {
      const double limit = std::exp(random.uniform(std::log(2.), std::log(40.)));
      const double speed = random.uniform(.02, .2);
      const double guess = one.Z * std::exp(random.uniform(-std::log(4.), std::log(4.)));
      Overrides plain = one.overrides, excited;
      plain.insert(plain.end(), {seeded(seed), "depth.initial=" + std::to_string(guess)});
      excited = {"control.excite={speed: " + std::to_string(speed) +
                 ", limit: " + std::to_string(limit) + "}"};
      const double moved =
          distance(run(one.file, plain, excited), run(one.file, plain, {"control.excite=null"}));
      EXPECT_LT(moved, limit) << one.what << ", seed " << seed << ", " << speed << " m/s, " << guess
                              << " m";
    }
  }
}

TEST(ActiveExcitation, leads_back_to_a_given_profile) {
  const RunLog with = run(kNearAxis, {}, {}), without = run(kNearAxis, {}, {"control.excite=null"});
  EXPECT_GT(distance(with, without), .2);
  EXPECT_LT(distance(with.frames.back(), without.frames.back()), .02);
}

TEST(ActiveExcitation, keeps_its_speed_where_the_robot_is_at_its_limits) {
  const RunLog log = run(kNearAxis, {}, {"control.profile=[{until: 10, v: [0, 0, 2, 0, 0, 0]}]"});
  for (std::size_t k = 5; k < 10; ++k) {
    const Velocities& v = log.frames[k].applied;
    EXPECT_NEAR(v.head<2>().norm(), .05, 1e-3);
    EXPECT_NEAR(v[2], .5, 1e-3);
  }
}

TEST(ActiveExcitation, holds_the_points_where_the_task_leaves_the_camera_free) {
  for (const Case& one : twoPointCases()) {
    Comparison runs;
    for (const double guess : {.5, 2., 8.}) {
      for (unsigned seed = 1; seed <= 7; ++seed) {
        Overrides overrides = one.overrides;
        overrides.insert(overrides.end(), {seeded(seed), "depth.initial=" + std::to_string(guess)});
        const RunLog with = run(one.file, overrides, {});
        const RunLog without = run(one.file, overrides, {"control.excite=null"});
        runs.add(with, without);
        // The circle of the camera by itself would move them by 9.5 px.
        EXPECT_LT(distance(with, without), 4) << one.what << ", guess " << guess << " m";
        EXPECT_GT(distance(with, without), .1);
      }
    }
    EXPECT_LE(2 * median(runs.with), median(runs.without)) << one.what;
  }
}

TEST(ActiveExcitation, ends_when_the_depths_are_known) {
  const RunLog log = run(kApproach, {}, {});
  EXPECT_EQ(log.outcome, Outcome::converged);
  std::vector<std::string> excitation;
  for (const Event& event : log.events) {
    if (event.what.find("active excitation") == 0) excitation.push_back(event.what);
  }
  // It may begin anew once: without it the noise of the odometry makes a known depth vague again.
  ASSERT_TRUE(excitation.size() == 2 || excitation.size() == 4) << excitation.size();
  for (std::size_t i = 1; i < excitation.size(); i += 2) {
    EXPECT_NE(excitation[i].find("ended"), std::string::npos) << excitation[i];
  }
}

TEST(ActiveExcitation, is_silent_when_the_depths_are_known) {
  const RunLog log = run(kApproach, {"depth.estimator=true"}, {});
  for (const Event& event : log.events) ADD_FAILURE() << event.time_s << " s: " << event.what;
}

}  // namespace
}  // namespace depthservo
