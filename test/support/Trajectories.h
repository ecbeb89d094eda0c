#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "depthservo/motion/Motion.h"

/// The benchmark's camera motions: 30 Hz, 300 frames, twist constant over each frame.
namespace depthservo::test {

struct Trajectory {
  std::string name;
  std::function<Twist(double)> twistAt;  // at the time [s]
  Eigen::Vector3d cP;                    // the point in the first camera frame [m]
  double focal_px;

  static constexpr double kRate = 30, kPeriod_s = 1 / kRate, kSigma_px = 0.25;
  static constexpr int kFrames = 300;  // the first is frame 0, in which the camera has not moved

  double sigma() const { return kSigma_px / focal_px; }

  /// Twist from frame k to frame k + 1.
  Twist twist(int k) const { return twistAt((k + 0.5) * kPeriod_s); }

  /// The point and three more that span a square of 0.12 of its depth, one of them deeper.
  std::vector<Eigen::Vector3d> fourPoints() const {
    const double Z = cP.z(), s = 0.12 * Z;
    return {cP, cP + Eigen::Vector3d(s, 0, 0), cP + Eigen::Vector3d(0, s, 0.1 * Z),
            cP + Eigen::Vector3d(s, s, 0)};
  }
};

/// Camera coordinates after a rigid motion of the camera, by rotation vectors: independent of
/// Motion.
inline Eigen::Vector3d moved(const Eigen::Vector3d& cP, const Twist& twist, double dt) {
  // Midpoint rotation of the frame, exact for constant twist up to the integral of the rotation,
  // which is summed over fine steps.
  constexpr int kSteps = 8;
  const double h = dt / kSteps;
  Eigen::Vector3d p = cP;
  for (int i = 0; i < kSteps; ++i) {
    const auto velocity = [&](const Eigen::Vector3d& q) -> Eigen::Vector3d {
      return -twist.linear - twist.angular.cross(q);
    };
    const Eigen::Vector3d k1 = velocity(p), k2 = velocity(p + h / 2 * k1),
                          k3 = velocity(p + h / 2 * k2), k4 = velocity(p + h * k3);
    p += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return p;
}

inline std::vector<Trajectory> trajectories() {
  constexpr double kPi = 3.14159265358979323846;
  const auto deLuca = [](double t) -> Twist {
    return {{.1 * std::cos(2 * kPi * t), 0, .5 * std::cos(kPi * t)},
            {.6 * std::cos(kPi * t / 2), 0, 1}};
  };
  const auto approach = [](double t) -> Twist {
    return {{0, 0, .294}, {0, .05 * std::sin(2 * kPi * t / 5), 0}};
  };
  const auto sideways = [](double t) -> Twist {
    return {{.2 * std::cos(.4 * kPi * t), 0, 0}, {0, 0, 0}};
  };
  const auto dying = [](double t) -> Twist {
    const double a = std::exp(-t);
    return {{a * .15, a * -.10, a * .20}, {a * .10, a * -.15, a * .30}};
  };
  const auto general = [](double t) {
    const double f[] = {.3, .7, 1.3}, v[] = {.08, .06, .03}, w[] = {.15, .10, .08};
    Twist u;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double wave = std::sin(2 * kPi * f[j] * t + i + 2.1 * (j + 1));
        (i < 3 ? u.linear[i] : u.angular[i - 3]) += (i < 3 ? v[j] : w[j]) * wave;
      }
    }
    return u;
  };
  const auto turning = [](double t) -> Twist {
    return {{0, 0, 0}, {.3 * std::cos(kPi * t), .2 * std::sin(kPi * t), .3}};
  };
  const auto still = [](double) -> Twist { return {}; };
  return {
      {"T1", deLuca, {.15625, -.15625, 2}, 128}, {"T1c", deLuca, {.0390625, -.0390625, .5}, 128},
      {"T2a", approach, {.20, .10, 3.9}, 600},   {"T2b", approach, {.03, -.02, 3.9}, 600},
      {"T3", sideways, {.05, -.05, 1}, 600},     {"T4", dying, {-.10, .08, 1.2}, 600},
      {"T5", general, {.10, .05, 1.5}, 600},     {"R0", turning, {.1, .05, 1.5}, 600},
      {"S0", still, {.1, .05, 1.5}, 600}};
}

inline Trajectory trajectory(const std::string& name) {
  for (const Trajectory& t : trajectories()) {
    if (t.name == name) return t;
  }
  return {};
}

}  // namespace depthservo::test
