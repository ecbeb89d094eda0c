#include "depthservo/depth/CramerRaoBound.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

/// sigma_chi [1/m] that stands for "nothing is known".
constexpr double kUnknown = 1e3;

/// Variance of an image coordinate that was never measured: far outside any image.
constexpr double kUnseen = 1e3;

}  // namespace

CramerRaoBound::CramerRaoBound(std::vector<PointState> points, double sigma_chi)
    : points_(std::move(points)),
      ahead_(points_.size(), true),
      P_(kUnseen * Eigen::MatrixXd::Identity(3 * points_.size(), 3 * points_.size())) {
  const double sigma = std::min(sigma_chi, kUnknown);
  for (std::size_t i = 0; i < points_.size(); ++i) P_(3 * i + 2, 3 * i + 2) = sigma * sigma;
}

void CramerRaoBound::advance(const Motion& motion, const OdometryNoise& odometry) {
  const Eigen::Index n = P_.rows();
  const OdometryNoise::Step noise = odometry.over(motion);
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(n, n), G = Eigen::MatrixXd::Zero(n, 6);
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(std::sqrt(noise.variance_t)),
      Eigen::Vector3d::Constant(std::sqrt(noise.variance_theta));
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!ahead_[i]) continue;
    const auto [next, isAhead] = flow(motion, points_[i]);
    ahead_[i] = isAhead;
    if (!isAhead) continue;
    const Eigen::Index k = 3 * static_cast<Eigen::Index>(i);
    F.block<3, 3>(k, k) = flowJacobian(motion, points_[i], next);
    G.block<3, 6>(k, 0) = rateByTwist(next) * sigma.asDiagonal();
    points_[i] = next;
  }
  P_ = F * P_ * F.transpose() + G * G.transpose();
}

void CramerRaoBound::measure(std::size_t i, double sigma) {
  if (!ahead_[i]) return;
  const Eigen::Index k = 3 * static_cast<Eigen::Index>(i);
  const double r = sigma * sigma;
  const Eigen::MatrixXd PH = P_.middleCols<2>(k);
  const Eigen::Matrix2d S = P_.block<2, 2>(k, k) + r * Eigen::Matrix2d::Identity();
  const Eigen::MatrixXd K = PH * S.inverse();
  // Joseph's form: stays positive with the wide start.
  Eigen::MatrixXd keep = Eigen::MatrixXd::Identity(P_.rows(), P_.cols());
  keep.middleCols<2>(k) -= K;
  P_ = keep * P_ * keep.transpose() + r * K * K.transpose();
}

double CramerRaoBound::sigma_chi(std::size_t i) const {
  if (!ahead_[i]) return std::numeric_limits<double>::infinity();
  const Eigen::Index k = 3 * static_cast<Eigen::Index>(i) + 2;
  return std::sqrt(P_(k, k));
}

}  // namespace depthservo
