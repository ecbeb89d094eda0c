#pragma once

#include <string>
#include <vector>

#include "observation/SelfDiagnosis.h"
#include "support/RobotExperiment.h"

/// Robots of which one thing errs, and what the diagnosis says of them.
namespace depthservo::test {

/// A source of errors, and the cause that it is.
struct ErrorSource {
  const char* name;
  ConsistencyMonitor::Cause cause;
  void (*add)(RobotErrors&, Random&, double size);  // size 1: as everyday robots have it
};

inline Eigen::Vector3d drawn(Random& random, double sigma) {
  return {random.normal(sigma), random.normal(sigma), random.normal(sigma)};
}

inline const std::vector<ErrorSource>& errorSources() {
  using Cause = ConsistencyMonitor::Cause;
  static const std::vector<ErrorSource> all{
      {"latency", Cause::latency,
       [](RobotErrors& e, Random&, double size) { e.latency_s = .012 * size; }},
      {"gyro bias", Cause::gyroBias,
       [](RobotErrors& e, Random& random, double size) { e.bias = drawn(random, .004 * size); }},
      {"mount", Cause::mount,
       [](RobotErrors& e, Random& random, double size) { e.mount = drawn(random, .007 * size); }},
      {"slip", Cause::slip, [](RobotErrors& e, Random&, double size) { e.slipSigma = .02 * size; }},
      {"focal length", Cause::focalLength,
       [](RobotErrors& e, Random& random, double size) {
         e.kappa = 1 + random.normal(.003 * size);
       }},
      {"wander", Cause::noise,
       [](RobotErrors& e, Random&, double size) { e.wander_px = .15 * size; }},
      {"jitter", Cause::noise,
       [](RobotErrors& e, Random&, double size) { e.jitter_s = .002 * size; }},
      {"scale", Cause::none,
       [](RobotErrors& e, Random& random, double size) { e.S = random.normal(.01 * size); }}};
  return all;
}

/// What the diagnosis with the profile `typical` names at the end of one such robot's recording.
inline ConsistencyMonitor::Diagnosis diagnosed(const ErrorSource& source, double size,
                                               unsigned seed) {
  Random random(11000 + seed);
  RobotErrors errors;
  source.add(errors, random, size);
  const Robot robot(seed, errors);
  SharedErrorFilterOptions options;
  options.focal_px = kRobotFocal_px;
  SelfDiagnosis diagnosis(Robot::kPoints, options.errors.odometry,
                          errors.pixelNoise_px / kRobotFocal_px, {3}, {}, {}, options);
  for (const RobotRun::Image& image : robot.run.images) {
    diagnosis.update(image.stamp_s, robot.run.odometry, image.points);
  }
  return diagnosis.result().latest;
}

}  // namespace depthservo::test
