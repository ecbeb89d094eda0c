#include "depthservo/rig/SimulatedRigOptions.h"

#include <fmt/format.h>

#include "rig/NoiseStream.h"
#include "text/below.h"

namespace depthservo {
namespace {

void checkOrder(const char* key, const Interlude& span, const Refuse& refuse) {
  if (span.from < span.to) return;
  refuse(key, fmt::format("from = {} s must be before to = {} s", span.from, span.to));
}

void checkPeriod(const char* key, const PointPeriod& period, std::size_t points,
                 const Refuse& refuse) {
  checkOrder(key, period, refuse);
  for (const int point : period.points) {
    if (point < static_cast<int>(points)) continue;
    refuse(key,
           fmt::format("there is no point {}; the target has points 0 to {}", point, points - 1));
  }
}

void checkSwapped(const SensingOptions& sensing, std::size_t points, const Refuse& refuse) {
  for (const PointPeriod& swapped : sensing.swapped) {
    checkPeriod("sensing.swapped", swapped, points, refuse);
    std::vector<int> each = swapped.points;
    std::sort(each.begin(), each.end());
    const bool isTwice = std::adjacent_find(each.begin(), each.end()) != each.end();
    if (each.size() < 2 || isTwice) {
      refuse("sensing.swapped", "points: expected two points or more, each of them once");
    }
  }
  if (!sensing.swapped.empty() && sensing.source == SensingSource::image) {
    refuse("sensing.swapped",
           "what a tracker makes of images is its own: sensing.source: geometry");
  }
}

}  // namespace

bool PointPeriod::covers(double time_s, int point) const {
  return Interlude::covers(time_s) &&
         (points.empty() || std::find(points.begin(), points.end(), point) != points.end());
}

double SensingOptions::assumedNoise_px() const {
  constexpr double kLeastNoise_px = 0.1;
  return assumed_noise.value_or(std::max(pixel_noise, kLeastNoise_px));
}

OdometryNoise OdometryOptions::declaredNoise() const {
  return noise.isZero() ? OdometryNoise::none() : OdometryNoise::white(noise[0], noise[1], mode);
}

SimulatedRigOptions drawnRobot(SimulatedRigOptions rig) {
  const auto stream = [&](ErrorSource source) { return NoiseStream(rig.seed, source); };
  OdometryOptions& odometry = rig.odometry;
  if (odometry.scale_drawn > 0) {
    const double S = odometry.scale_drawn * stream(ErrorSource::scale).next();
    odometry.scale /= 1 + odometry.scale * S;
  }
  if (odometry.gyro_bias_drawn > 0) {
    odometry.gyro_bias += odometry.gyro_bias_drawn * stream(ErrorSource::gyroBias).next3();
  }
  if (rig.sensing.latency_drawn > 0) {
    const double drawn = stream(ErrorSource::latency).next();
    rig.sensing.latency += rig.sensing.latency_drawn * std::abs(drawn);
  }
  if (rig.camera.focal_drawn > 0) {
    rig.camera.focal_error += rig.camera.focal_drawn * stream(ErrorSource::focal).next();
  }
  if (rig.robot.mount_drawn > 0) {
    rig.robot.mount_error += rig.robot.mount_drawn * stream(ErrorSource::mount).next3();
  }
  odometry.scale_drawn = odometry.gyro_bias_drawn = 0;
  rig.sensing.latency_drawn = rig.camera.focal_drawn = rig.robot.mount_drawn = 0;
  return rig;
}

void check(const SimulatedRigOptions& rig, const Refuse& refuse) {
  const CameraOptions& camera = rig.camera;
  if (camera.cx > camera.width - 1 || camera.cy > camera.height - 1) {
    refuse("camera", fmt::format("the principal point ({}, {}) px lies outside the {}x{} image",
                                 camera.cx, camera.cy, camera.width, camera.height));
  }
  check(rig.target, detail::below("target", refuse));
  check(rig.robot, detail::below("robot", refuse));
  if (rig.odometry.rows == RowMeaning::instant && rig.odometry.ticks > 0) {
    refuse("odometry.rows", "encoders with ticks count ways: hold or mean-before");
  }
  const SensingOptions& sensing = rig.sensing;
  if (sensing.tracker != rig.target.type) refuse("sensing.tracker", "must be as target.type");
  if (sensing.light_on_dark && (rig.target.type == TargetKind::apriltag || rig.target.hasBoard())) {
    refuse("sensing.light_on_dark", "tags and boards are dark on light");
  }
  for (const PointPeriod& hidden : sensing.hidden) {
    checkPeriod("sensing.hidden", hidden, rig.target.points.size(), refuse);
  }
  checkSwapped(sensing, rig.target.points.size(), refuse);
  for (const Interlude& gap : rig.odometry.gaps) checkOrder("odometry.gaps", gap, refuse);
  for (const Interlude& span : rig.robot.stuck) checkOrder("robot.stuck", span, refuse);
  const double interval_s = (1 - camera.jitter) / camera.fastest();
  if (sensing.exposure > interval_s) {
    refuse("sensing.exposure", fmt::format("{} s is longer than the time between images, {} s",
                                           sensing.exposure, interval_s));
  }
  if (rig.robot.type == RobotKind::unicycle) return;
  if (rig.odometry.ticks != 0) {
    refuse("odometry.ticks", "only robot.type unicycle has wheels that count");
  }
  if (rig.odometry.mode == OdometryMode::commanded && !rig.odometry.noise.isZero()) {
    refuse("odometry.mode", "noise of commanded odometry needs robot.type unicycle");
  }
}

}  // namespace depthservo
