#include <gtest/gtest.h>

#include "depthservo/text/InputError.h"
#include "support/CalibrationExperiment.h"

namespace depthservo::test {
namespace {

TEST(Calibration, is_within_its_own_sigmas_and_makes_another_drive_honest) {
  constexpr unsigned kOtherCourse = 101;
  const CalibrationHonesty robot(0, kOtherCourse);
  EXPECT_GE(robot.shown, 6);
  EXPECT_EQ(robot.within, robot.shown);
  EXPECT_GE(robot.otherDrive.coverage, 0.9);
  EXPECT_GE(robot.otherDrive.valid, 0.7);
}

TEST(Calibration, does_not_claim_what_a_camera_at_rest_cannot_show) {
  Robot robot = Robot::typical(0);
  robot.run = drive({0, 0, 0, 0, 5}, robot.errors, 1.5707963267948966,
                    {{0, 3, .2}, {.5, 3.5, .6}, {-.4, 2.5, 0}}, 1, 10);
  const Calibration c = calibrate(logOf(robot));
  for (const Calibrated& constant : c.constants) {
    const bool isBias = constant.name.rfind("gyro_bias", 0) == 0;
    if (!isBias) {
      EXPECT_FALSE(constant.isShown) << constant.name;
      EXPECT_FALSE(constant.missing.empty());
    }
  }
}

TEST(Calibration, needs_points_and_odometry) { EXPECT_THROW(calibrate(RunLog{}), InputError); }

}  // namespace
}  // namespace depthservo::test
