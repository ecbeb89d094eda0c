#include "depthservo/depth/ErrorProfile.h"

namespace depthservo {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

}  // namespace

ErrorProfile ErrorProfile::typical() {
  ErrorProfile p;
  p.scale = 0.015;
  p.slip = {0.02, 0.5};
  p.gyroBias_rad_s = 0.010;
  p.odometry = OdometryNoise::white(0.001, 0.003);
  p.latency_s = 0.030;
  p.jitter_s = 0.002;
  p.focal = 0.005;
  p.mount_rad = 0.7 * kDegree;
  p.wander_px = {0.15, 0.7};
  p.position_m = 0.001 / std::sqrt(12.);  // a tick of the wheels' encoders
  return p;
}

ErrorProfile ErrorProfile::arm() {
  ErrorProfile p;
  p.scale = 0.001;
  p.odometry = OdometryNoise::white(0.0005, 0.0005);
  p.latency_s = 0.020;
  p.focal = 0.005;
  p.mount_rad = 0.5 * kDegree;
  p.wander_px = {0.15, 0.7};
  return p;
}

ErrorProfile ErrorProfile::poses() {
  ErrorProfile p;
  p.odometry = OdometryNoise::white(0.002, 0.001);  // what lasts from pose to pose
  p.focal = 0.005;
  p.wander_px = {0.3, 0.7};
  p.position_m = 0.005;
  p.angle_rad = 0.005;
  return p;
}

}  // namespace depthservo
