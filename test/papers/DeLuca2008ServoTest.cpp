// The success tables of sections 7.2 and 7.3 against the specification's, which come from another
// program. Starts are counted; two of 35 may differ, since the noise does. All rows are judged by
// `depthservo reproduce`; here is what the sweeps are made of.
#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/scenario/run.h"
#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

Sweep shipped(const std::string& name) {
  return Sweep::load(DEPTHSERVO_DATA "/sweeps/deluca2008/" + name + ".yaml",
                     [](const std::string& scenario) { return scenario; });
}

/// Runs with these depths and this guess, by start.
std::vector<SweepResult> results(const Sweep& sweep, const std::string& depths,
                                 const std::string& guess) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < sweep.size(); ++i) {
    const std::vector<std::string> cells = sweep.row(i).cells;
    if (cells.end()[-3] == depths && cells.end()[-2] == guess) rows.push_back(i);
  }
  return runRows(sweep, rows);
}

int reached(const Sweep& sweep, const std::string& depths, const std::string& guess) {
  int count = 0;
  for (const SweepResult& result : results(sweep, depths, guess)) {
    count += result.outcome == "converged" ? 1 : 0;
  }
  return count;
}

TEST(DeLuca2008Servo, goalOfThePointsIsThatOfThePaper) {
  const double pixels[4][2] = {{46, 379}, {143, 374}, {139, 201}, {38, 203}};
  for (const char* name : {"points-640x480", "points-1024x768"}) {
    const Sweep sweep = shipped(name);
    const Scenario scenario = sweep.scenario(sweep.row(0));
    const SimulatedRig rig(static_cast<const SimulatedRigOptions&>(scenario));
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d seen(rig.truthAtGoal()[i].u, rig.truthAtGoal()[i].v);
      // A level camera fits the paper's pixels to 2.4 px rms.
      EXPECT_NEAR(seen.x(), pixels[i][0], 5) << name << ", dot " << i;
      EXPECT_NEAR(seen.y(), pixels[i][1], 5) << name << ", dot " << i;
    }
  }
}

/// The plate as the names of the starts have it: its middle at (X, Z) in the camera, by the poses
/// of robot and plate alone.
TEST(DeLuca2008Servo, startsAreWhereTheirNamesSay) {
  for (const auto& [name, Z] : {std::pair{"points-640x480", 3.9},
                                {"points-1024x768", 3.9},
                                {"search-640x480", 3.9},
                                {"search-1024x768-late", 3.9},
                                {"moments-640x480", 4.1},
                                {"moments-1024x768", 4.1}}) {
    const Sweep sweep = shipped(name);
    std::size_t starts = sweep.options().axes.back().cases.size();
    EXPECT_EQ(starts, std::string(name).rfind("search", 0) == 0 ? 63u : 35u) << name;
    for (std::size_t i = 0; i < starts; ++i) {
      const Sweep::Row row = sweep.row(i);
      const RobotPose pose = sweep.scenario(row).robot.initial;
      double X = 0, heading = 0;
      ASSERT_EQ(std::sscanf(row.cells.back().c_str(), "%lf m %lf deg", &X, &heading), 2);
      const double c = std::cos(pose.theta), s = std::sin(pose.theta);
      const double forward = -(c * pose.x + s * pose.y), left = s * pose.x - c * pose.y;
      EXPECT_NEAR(pose.theta, heading * M_PI / 180, 1e-4) << row.cells.back();
      EXPECT_NEAR(forward - 0.07, Z, 1e-3) << row.cells.back();
      EXPECT_NEAR(-(left - 0.02), X, 0.006) << row.cells.back();
    }
  }
}

TEST(DeLuca2008Servo, pointsReachTheGoalWithOneDepthForThePlateFromEveryGuess) {
  for (const auto& [name, expected] : {std::pair{"points-640x480", 31}, {"points-1024x768", 28}}) {
    const Sweep sweep = shipped(name);
    EXPECT_NEAR(reached(sweep, "true", "3"), expected, 2);
    for (const char* guess : {"1.6", "3", "5", "8"}) {
      EXPECT_NEAR(reached(sweep, "object", guess), expected, 2) << guess;
    }
  }
}

TEST(DeLuca2008Servo, pointsWithAConstantDepthFailTheMoreTheLargerItIs) {
  const Sweep sweep = shipped("points-640x480");
  for (const auto& [guess, count] : {std::pair{"1.6", 33}, {"3", 25}, {"5", 21}, {"8", 14}}) {
    EXPECT_NEAR(reached(sweep, "constant", guess), count, 2) << guess;
  }
}

TEST(DeLuca2008Servo, momentsFromAnUnderestimatedGuessNeedTheTightClamp) {
  const Sweep sweep = shipped("moments-640x480");  // both choices of the features
  EXPECT_GE(reached(sweep, "observer", "0.9"), 2 * 33);
  EXPECT_NEAR(reached(sweep, "loose", "0.9"), 25 + 30, 2);
}

TEST(DeLuca2008Servo, imagesEndAsExactGeometryDoes) {
  const Sweep sweep = shipped("points-640x480");
  for (const char* guess : {"1.6", "8"}) {
    const std::vector<SweepResult> exact = results(sweep, "object", guess);
    const std::vector<std::size_t> rows = {exact[3].row, exact[17].row, exact[30].row};
    const std::vector<SweepResult> seen = runRows(sweep, rows, {"sensing.source=image"});
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const SweepResult& same = exact[std::vector<std::size_t>{3, 17, 30}[i]];
      EXPECT_EQ(seen[i].outcome, same.outcome) << rows[i];
      EXPECT_NEAR(seen[i].metrics[1], same.metrics[1], 2) << rows[i];
    }
  }
}

/// A servo whose commands come late: a robot at rest does not move for that time.
TEST(DeLuca2008Servo, deadTimeDelaysTheFirstMotion) {
  const Sweep sweep = shipped("search-1024x768-late");
  const auto firstMotion = [&](const std::vector<std::string>& overrides) {
    for (const FrameRecord& frame : run(sweep.scenario(sweep.row(0), overrides)).frames) {
      if (frame.applied.norm() > 0) return frame.time_s;
    }
    return 0.;
  };
  const double atOnce_s = firstMotion({"robot.dead_time=0"});
  EXPECT_NEAR(firstMotion({}) - atOnce_s, 0.3, 1e-6);
  EXPECT_NEAR(firstMotion({"robot.dead_time=0.1"}) - atOnce_s, 0.1, 1e-6);
}

/// Late commands swing a dot out of the image and in again. The paper's servo is lost then.
TEST(DeLuca2008Servo, allDotsMustStayInTheImage) {
  const Sweep sweep = shipped("search-1024x768-late");
  for (const SweepResult& result : results(sweep, "object", "1.6")) {
    const Sweep::Row row = sweep.row(result.row);
    if (row.cells.back() != "-0.43 m -45 deg") continue;
    EXPECT_EQ(result.outcome, "left-image") << result.reason;
    const RunLog loose = run(sweep.scenario(row, {"control.all_in_image=false"}));
    EXPECT_EQ(loose.outcome, Outcome::converged) << loose.reason;
    EXPECT_LT(computeMetrics(loose).min_border_px, 0);
    return;
  }
  FAIL() << "no such start";
}

}  // namespace
}  // namespace depthservo
