#pragma once

#include <cmath>
#include <string>

#include "depthservo/observation/RunLog.h"

namespace depthservo::test {

/// A made-up run: a camera approaches four points from 4 m to 1 m within 12 s; depths start twice
/// too far and become right; point 2 is hidden from 5 s to 6 s.
inline RunLog exampleLog(int frameCount = 361) {
  RunLog log;
  log.command = "run";
  log.name = "four-points";
  log.seed = 7;
  log.camera = {640, 480, 600, 600, 319.5, 239.5};
  log.configuration =
      R"({"name": "four-points", "robot": {"goal": {"x": -1, "y": 0, "theta": 0}},)"
      R"("target": {"points": [[-0.1,-0.1,0],[0.1,-0.1,0],[0.1,0.1,0],[-0.1,0.1,0]],)"
      R"("pose": {"xyz": [0,0,0.13], "rpy": [-1.5707963267948966, 0, -1.5707963267948966]}}})";
  log.commandNames = {"v [m/s]", "w [rad/s]"};
  log.hasOutcome = true;
  log.outcome = Outcome::converged;
  log.reason = "The image error stayed below 1.5 px for 1 s.";
  log.cdMc = Eigen::Isometry3d(Eigen::Translation3d(0, 0, -0.3) *
                               Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()));
  log.events = {{5.0, "point 2 hidden"}, {6.0, "point 2 seen again"}};
  const double side[4][2] = {{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}};
  for (const auto& corner : side) {
    log.goals.emplace_back(600 * corner[0] + 319.5, 600 * corner[1] + 239.5);
  }
  for (int k = 0; k < frameCount; ++k) {
    FrameRecord frame;
    frame.time_s = k / 30.0;
    const double t = 12.0 * k / (frameCount - 1);
    const double distance = 1 + 2.9 * std::exp(-0.45 * t),
                 sway = 0.3 * std::exp(-0.5 * t) * std::cos(t);
    const double v = 0.45 * 2.9 * std::exp(-0.45 * t);
    frame.error_px = 180 * std::exp(-0.5 * t) + 0.31;
    frame.command = Eigen::Vector2d(v, 0.2 * std::sin(t));
    frame.applied = Eigen::Vector2d(std::min(v, 0.5), 0.2 * std::sin(t - 0.05));
    frame.twist.linear = {0, 0, frame.applied[0]};
    frame.twist.angular = {0, -frame.applied[1], 0};
    frame.robotPose = {-distance, sway, -0.5 * sway};
    for (int id = 0; id < 4; ++id) {
      const double Z = distance + 0.02 * id;
      const double factor = 1 + std::exp(-0.9 * t) * std::cos(1.3 * t) + 0.008;
      FeatureRecord feature;
      feature.id = id;
      feature.measured = !(id == 2 && frame.time_s >= 5 && frame.time_s < 6);
      feature.u_true = 600 * (side[id][0] + sway) / Z + 319.5;
      feature.v_true = 600 * side[id][1] / Z + 239.5;
      feature.u = feature.u_true + 0.1;
      feature.v = feature.v_true - 0.1;
      feature.Z_true = Z;
      feature.estimate.chi = 1 / (Z * factor);
      feature.estimate.sigma_chi = (0.004 + 0.6 * std::exp(-0.9 * t)) / Z;
      feature.estimate.excitation = 0.1 * v * (1 + 0.1 * id);
      feature.estimate.status = !feature.measured ? DepthStatus::coasting
                                : t < 3           ? DepthStatus::converging
                                                  : DepthStatus::valid;
      frame.features.push_back(feature);
    }
    log.frames.push_back(frame);
  }
  std::vector<unsigned char> image(640 * 480);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image[i] = static_cast<unsigned char>(150 + (i % 640 + i / 640) % 64);
  }
  log.images = {{"first", image}, {"last", image}};
  log.timings = {{"estimate", {1e-6, 3e-6, 2e-6}}};
  return log;
}

/// The same as a replay: nothing is known of goals, commands, the robot or the truth; epoch
/// seconds.
inline RunLog exampleReplay() {
  RunLog log = exampleLog();
  log.command = "replay";
  log.hasOutcome = false;
  log.cdMc.reset();
  log.goals.clear();
  log.commandNames.clear();
  log.images.clear();
  for (FrameRecord& frame : log.frames) {
    frame.time_s += 1305031102.175304;
    frame.error_px = kUnknown;
    frame.command.resize(0);
    frame.applied.resize(0);
    frame.robotPose.setConstant(kUnknown);
    for (FeatureRecord& feature : frame.features) {
      feature.Z_true = feature.u_true = feature.v_true = kUnknown;
    }
  }
  for (Event& event : log.events) event.time_s += 1305031102.175304;
  return log;
}

}  // namespace depthservo::test
