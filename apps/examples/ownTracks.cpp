// Depths from your own tracks, with Eigen alone: pixels of any tracker and the camera's twists go
// in, Z with its 2-sigma band comes out. Here both are made up: three points, one of them hidden
// for a second. doc/core.md explains the calls.
#include <depthservo/camera/PinholeCamera.h>
#include <depthservo/depth/InverseDepthFilter.h>
#include <depthservo/depth/PointwiseEstimator.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>
#include <vector>

int main() {
  constexpr double kRate = 30, kSigma_px = 0.5;
  const depthservo::PinholeCamera camera{640, 480, 600, 600, 319.5, 239.5};
  const depthservo::Twist twist{{0.12, 0.02, 0.05},
                                {0, 0.03, 0}};  // m/s, rad/s: the camera's own, in its frame
  std::vector<Eigen::Vector3d> points{
      {-0.4, -0.2, 2}, {0.3, 0.1, 3}, {0.1, 0.3, 4.5}};  // m, in the camera frame
  std::mt19937 random(1);
  std::normal_distribution<double> noise_px(0, kSigma_px);

  depthservo::InverseDepthFilterOptions options;
  options.odometry = depthservo::OdometryNoise::white(0.002, 0.001);  // m/s, rad/s per row and axis
  depthservo::PointwiseEstimator depths(depthservo::InverseDepthFilter(options), points.size(),
                                        {1.0});  // first guess: 1 m
  depthservo::MotionBuffer odometry;

  for (int k = 0; k < 5 * kRate; ++k) {
    const double time_s = k / kRate;
    odometry.push(time_s, twist);      // whenever a row of odometry arrives
    depths.advance(odometry, time_s);  // at every image: to the time of its exposure ...
    std::vector<depthservo::PointObservation> seen;
    for (int id = 0; id < 3; ++id) {
      if (id == 1 && k >= 60 && k < 90) continue;  // hidden: left out
      const Eigen::Vector3d& p = points[id];
      const Eigen::Vector2d uv = camera.toPixel(p.x() / p.z(), p.y() / p.z());
      const Eigen::Vector2d xy =
          camera.normalise(uv.x() + noise_px(random), uv.y() + noise_px(random));
      seen.push_back({id, {xy.x(), xy.y(), kSigma_px / camera.focal_px()}});
    }
    depths.correct(seen);  // ... and what is seen in it
    const auto motion = depthservo::Motion::fromTwist(twist, 1 / kRate);
    if (k + 1 < 5 * kRate) {
      for (Eigen::Vector3d& p : points) p = motion.R * p + motion.t;
    }
  }

  double worst = 0;
  for (int id = 0; id < 3; ++id) {
    const depthservo::DepthEstimate e = depths.estimate(id);
    std::cout << "point " << id << ": Z " << e.Z() << " +- " << 2 * e.sigma_Z() << " m (2 sigma), "
              << e.status << ", truth " << points[id].z() << " m\n";
    worst = std::max(worst, std::abs(e.Z() / points[id].z() - 1));
  }
  return worst < 0.05 ? 0 : 1;
}
