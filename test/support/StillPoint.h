#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/motion/Twist.h"

namespace depthservo::test {

/// The truth of every depth test: a still point in the frame of a moving camera, by integrating
/// dp/dt = -v - w x p (Runge-Kutta 4, 1 ms or finer). Knows nothing of exponentials and flows.
class StillPoint {
 public:
  explicit StillPoint(const Eigen::Vector3d& cP) : cP_(cP) {}
  static StillPoint at(double x, double y, double Z) { return StillPoint({x * Z, y * Z, Z}); }

  void move(const std::function<Twist(double)>& twistAt, double t0_s, double t1_s) {
    const int steps = std::max(1, static_cast<int>(std::ceil((t1_s - t0_s) / 1e-3)));
    const double h = (t1_s - t0_s) / steps;
    for (int i = 0; i < steps; ++i) {
      const double t = t0_s + i * h;
      const Eigen::Vector3d k1 = velocity(twistAt(t), cP_);
      const Eigen::Vector3d k2 = velocity(twistAt(t + h / 2), cP_ + h / 2 * k1);
      const Eigen::Vector3d k3 = velocity(twistAt(t + h / 2), cP_ + h / 2 * k2);
      const Eigen::Vector3d k4 = velocity(twistAt(t + h), cP_ + h * k3);
      cP_ += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
  }
  void move(const Twist& twist, double dt) {
    move([&twist](double) { return twist; }, 0, dt);
  }

  const Eigen::Vector3d& cP() const { return cP_; }
  double x() const { return cP_.x() / cP_.z(); }
  double y() const { return cP_.y() / cP_.z(); }
  double Z() const { return cP_.z(); }
  double chi() const { return 1 / cP_.z(); }

  PointMeasurement measured(double sigma = 0) const { return {x(), y(), sigma}; }

 private:
  static Eigen::Vector3d velocity(const Twist& u, const Eigen::Vector3d& p) {
    return -u.linear - u.angular.cross(p);
  }

  Eigen::Vector3d cP_;
};

}  // namespace depthservo::test
