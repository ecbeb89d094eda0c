#include "depthservo/camera/LensDistortion.h"

#include <Eigen/LU>
#include <algorithm>

namespace depthservo {
namespace {

constexpr double kFarthest = 10;  // normalised radius; 84 degrees off the axis
constexpr int kNewtonSteps = 8;
constexpr double kSolved = 1e-9;  // normalised

}  // namespace

LensDistortion::LensDistortion(double k1, double k2, double p1, double p2, double k3)
    : k1_(k1),
      k2_(k2),
      p1_(p1),
      p2_(p2),
      k3_(k3),
      isNone_(k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0) {
  constexpr double kStep = 1e-3;
  for (double r = 0; r < kFarthest; r += kStep) {
    const double r2 = r * r;
    if (1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) > 0) continue;
    reach_ = std::max(r - kStep, kStep);
    return;
  }
}

Eigen::Vector2d LensDistortion::distort(const Eigen::Vector2d& ideal) const {
  if (isNone_) return ideal;
  const double scale = std::max(1.0, ideal.norm() / reach_);
  const double x = ideal.x() / scale, y = ideal.y() / scale, r2 = x * x + y * y;
  const double q = 1 + r2 * (k1_ + r2 * (k2_ + r2 * k3_));
  return {scale * (q * x + 2 * p1_ * x * y + p2_ * (r2 + 2 * x * x)),
          scale * (q * y + p1_ * (r2 + 2 * y * y) + 2 * p2_ * x * y)};
}

Eigen::Matrix2d LensDistortion::J_distorted_ideal(const Eigen::Vector2d& ideal) const {
  if (isNone_) return Eigen::Matrix2d::Identity();
  const double scale = std::max(1.0, ideal.norm() / reach_);
  const double x = ideal.x() / scale, y = ideal.y() / scale, r2 = x * x + y * y;
  const double q = 1 + r2 * (k1_ + r2 * (k2_ + r2 * k3_));
  const double dq = k1_ + r2 * (2 * k2_ + 3 * k3_ * r2);  // by r^2
  Eigen::Matrix2d J;
  J(0, 0) = q + 2 * x * x * dq + 2 * p1_ * y + 6 * p2_ * x;
  J(1, 1) = q + 2 * y * y * dq + 6 * p1_ * y + 2 * p2_ * x;
  J(0, 1) = J(1, 0) = 2 * x * y * dq + 2 * p1_ * x + 2 * p2_ * y;
  return J;
}

Eigen::Vector2d LensDistortion::undistort(const Eigen::Vector2d& distorted) const {
  if (isNone_) return distorted;
  Eigen::Vector2d ideal = distorted;
  for (int i = 0; i < kNewtonSteps; ++i) {
    ideal -= J_distorted_ideal(ideal).inverse() * (distort(ideal) - distorted);
  }
  const double error = (distort(ideal) - distorted).norm();
  return error < kSolved && ideal.norm() <= reach_ ? ideal : distorted;
}

bool LensDistortion::isInvertibleAt(const Eigen::Vector2d& distorted) const {
  const Eigen::Vector2d ideal = undistort(distorted);
  return ideal.norm() <= reach_ && (distort(ideal) - distorted).norm() < kSolved;
}

}  // namespace depthservo
