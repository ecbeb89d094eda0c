#pragma once

#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/experiments/Calibration.h"
#include "support/RobotExperiment.h"

namespace depthservo::test {

/// What a replay of this robot's recording leaves behind.
inline RunLog logOf(const Robot& robot) {
  RunLog log;
  log.name = "robot";
  log.camera = {640, 480, kRobotFocal_px, kRobotFocal_px, 319.5, 239.5};
  constexpr double kRow_s = 0.02;
  for (int i = 0;; ++i) {
    const double begin = -1 + i * kRow_s;
    const auto row = robot.run.odometry.meanTwist(begin, begin + kRow_s);
    if (row.coverage != Coverage::complete) break;
    log.odometry.push_back({begin, row.twist});
  }
  for (const RobotRun::Image& image : robot.run.images) {
    FrameRecord frame;
    frame.time_s = image.stamp_s;
    for (const PointObservation& o : image.points) {
      FeatureRecord f;
      f.id = o.id;
      f.u = log.camera.cx + log.camera.fx * o.measurement.x;
      f.v = log.camera.cy + log.camera.fy * o.measurement.y;
      f.measured = true;
      f.sigma_px = kRobotFocal_px * o.measurement.sigma;
      frame.features.push_back(f);
    }
    log.frames.push_back(frame);
  }
  return log;
}

/// The true constants in the order of Calibration::constants, without the scale.
inline std::vector<double> truthOf(const RobotErrors& e) {
  return {e.latency_s, e.bias(0),  e.bias(1),  e.bias(2),
          e.mount(0),  e.mount(1), e.mount(2), e.kappa - 1};
}

/// Of a robot and its calibration: how many shown constants there are, how many lie within three
/// sigma, and how honest depths are on another recording of the robot.
struct CalibrationHonesty {
  int shown = 0, within = 0;
  Calibration calibration;
  Honesty otherDrive;

  CalibrationHonesty(unsigned seed, unsigned other) {
    const Robot robot = Robot::typical(seed);
    calibration = calibrate(logOf(robot));
    const std::vector<double> truth = truthOf(robot.errors);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Calibrated& c = calibration.constants[i];
      shown += c.isShown;
      within += c.isShown && std::abs(c.value - truth[i]) <= 3 * c.sigma;
    }
    SharedErrorFilterOptions options;
    options.errors = calibration.profile;
    SharedErrorFilter filter(Robot::kPoints, options, {3});
    otherDrive = Robot(other, robot.errors).judge(filter);
  }
};

}  // namespace depthservo::test
