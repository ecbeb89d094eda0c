#pragma once

#include <random>

#include "depthservo/motion/Twist.h"

namespace depthservo::test {

/// Seeded draws; the same on every machine that has the same standard library.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double normal(double sigma) { return sigma * std::normal_distribution<double>()(engine_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }

  Eigen::Vector3d vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Eigen::Vector3d direction() {
    return Eigen::Vector3d(normal(1), normal(1), normal(1)).normalized();
  }
  Twist twist(double speed, double turnRate) { return {vector(speed), vector(turnRate)}; }

 private:
  std::mt19937 engine_;
};

}  // namespace depthservo::test
