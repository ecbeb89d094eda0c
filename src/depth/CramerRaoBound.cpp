#include "depthservo/depth/CramerRaoBound.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "depth/byLastingErrors.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

/// sigma_chi [1/m] that stands for "nothing is known".
constexpr double kUnknown = 1e3;

/// Variance of an image coordinate that was never measured: far outside any image.
constexpr double kUnseen = 1e3;

/// Rows of the shared states, from the first.
struct SharedRow {
  static constexpr Eigen::Index latency = 0, bias = 1, mount = 4, focal = 7, scale = 8, slip = 9,
                                pose = 10, jitter = 16, count = 17;
};

/// Whether any error of a profile is a state of its own.
bool lasts(const ErrorProfile& e) {
  return e.scale > 0 || e.slip.sigma > 0 || e.gyroBias_rad_s > 0 || e.latency_s > 0 ||
         e.jitter_s > 0 || e.focal > 0 || e.mount_rad > 0 || e.wander_px.sigma > 0 ||
         e.position_m > 0 || e.angle_rad > 0;
}

}  // namespace

CramerRaoBound::CramerRaoBound(std::vector<PointState> points, double sigma_chi,
                               const ErrorProfile& errors, double focal_px)
    : points_(std::move(points)),
      ahead_(points_.size(), true),
      errors_(errors),
      wander_(errors.wander_px.sigma / focal_px) {
  const auto n = static_cast<Eigen::Index>(points_.size());
  shared_ = 3 * n;
  wanders_ = shared_ + (lasts(errors) ? Eigen::Index(SharedRow::count) : 0);
  const Eigen::Index rows = wanders_ + (lasts(errors) ? 2 * n : 0);
  P_ = Eigen::MatrixXd::Zero(rows, rows);
  const double sigma = std::min(sigma_chi, kUnknown);
  for (Eigen::Index i = 0; i < n; ++i) {
    P_.diagonal().segment<3>(3 * i) << kUnseen, kUnseen, sigma * sigma;
  }
  if (!lasts(errors)) return;
  renew(shared_ + SharedRow::latency, 1, errors.latency_s, 0);
  for (int axis = 0; axis < 3; ++axis) {
    renew(shared_ + SharedRow::bias + axis, 1, errors.gyroBiasSigma(axis), 0);
    renew(shared_ + SharedRow::mount + axis, 1, errors.mountSigma(axis), 0);
  }
  renew(shared_ + SharedRow::focal, 1, errors.focal, 0);
  renew(shared_ + SharedRow::scale, 1, errors.scale, 0);
  renew(shared_ + SharedRow::slip, 1, errors.slip.sigma, 0);
  renew(shared_ + SharedRow::pose, 3, errors.position_m, 0);
  renew(shared_ + SharedRow::pose + 3, 3, errors.angle_rad, 0);
  renew(shared_ + SharedRow::jitter, 1, errors.jitter_s, 0);
  renew(wanders_, 2 * n, wander_, 0);
}

/// Gauss-Markov states go on: keep this much of themselves, and their variance is refilled.
void CramerRaoBound::renew(Eigen::Index first, Eigen::Index count, double sigma, double kept) {
  P_.middleRows(first, count) *= kept;
  P_.middleCols(first, count) *= kept;
  P_.diagonal().segment(first, count).array() += sigma * sigma * (1 - kept * kept);
}

void CramerRaoBound::advance(const Motion& motion, const OdometryNoise& odometry) {
  const Eigen::Index n = P_.rows();
  const OdometryNoise::Step noise = odometry.over(motion);
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(n, n), G = Eigen::MatrixXd::Zero(n, 6);
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(std::sqrt(noise.variance_t)),
      Eigen::Vector3d::Constant(std::sqrt(noise.variance_theta));
  const Twist twist = motion.twist();
  const Vector6d change = hasTwist_ ? Vector6d(twist.vector() - twist_.vector()) : Vector6d::Zero();
  hasTwist_ = true;
  twist_ = twist;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!ahead_[i]) continue;
    const auto [next, isAhead] = flow(motion, points_[i]);
    ahead_[i] = isAhead;
    if (!isAhead) continue;
    const Eigen::Index k = 3 * static_cast<Eigen::Index>(i);
    const Eigen::Matrix<double, 3, 6> L = rateByTwist(next);
    const Eigen::Matrix3d J = flowJacobian(motion, points_[i], next);
    F.block<3, 3>(k, k) = J;
    G.block<3, 6>(k, 0) = L * sigma.asDiagonal();
    if (wanders_ > shared_) {
      F.block<3, 1>(k, shared_ + SharedRow::latency) = -L * change;
      F.block<3, 3>(k, shared_ + SharedRow::bias) = -motion.dt * L.rightCols<3>();
      F.block<3, 3>(k, shared_ + SharedRow::mount) = motion.dt * detail::byMount(L, twist);
      F.block<3, 1>(k, shared_ + SharedRow::scale) = F.block<3, 1>(k, shared_ + SharedRow::slip) =
          detail::byScale(points_[i], J, next);
    }
    points_[i] = next;
  }
  P_ = F * P_ * F.transpose() + G * G.transpose();
  if (wanders_ == shared_) return;
  const GaussMarkov pose{1, errors_.poseTau_s};
  renew(shared_ + SharedRow::slip, 1, errors_.slip.sigma, errors_.slip.kept(motion.dt));
  renew(shared_ + SharedRow::pose, 3, errors_.position_m, pose.kept(motion.dt));
  renew(shared_ + SharedRow::pose + 3, 3, errors_.angle_rad, pose.kept(motion.dt));
  renew(shared_ + SharedRow::jitter, 1, errors_.jitter_s, 0);
  renew(wanders_, n - wanders_, wander_, errors_.wander_px.kept(motion.dt));
}

void CramerRaoBound::measure(std::size_t i, double sigma) {
  if (!ahead_[i]) return;
  const Eigen::Index k = 3 * static_cast<Eigen::Index>(i);
  const double r = sigma * sigma;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, P_.rows());
  H.middleCols<2>(k).setIdentity();
  if (wanders_ > shared_) {
    const PointState& p = points_[i];
    const Eigen::Matrix<double, 2, 6> L = rateByTwist(p).topRows<2>();
    H.col(shared_ + SharedRow::focal) << p.x, p.y;
    H.middleCols<6>(shared_ + SharedRow::pose) = L;
    if (hasTwist_) H.col(shared_ + SharedRow::jitter) = -L * twist_.vector();
    H.middleCols<2>(wanders_ + 2 * static_cast<Eigen::Index>(i)).setIdentity();
  }
  const Eigen::MatrixXd PH = P_ * H.transpose();
  const Eigen::Matrix2d S = H * PH + r * Eigen::Matrix2d::Identity();
  const Eigen::MatrixXd K = PH * S.inverse();
  // Joseph's form: stays positive with the wide start.
  const Eigen::MatrixXd keep = Eigen::MatrixXd::Identity(P_.rows(), P_.cols()) - K * H;
  P_ = keep * P_ * keep.transpose() + r * K * K.transpose();
}

double CramerRaoBound::sigma_chi(std::size_t i) const {
  if (!ahead_[i]) return std::numeric_limits<double>::infinity();
  const Eigen::Index k = 3 * static_cast<Eigen::Index>(i) + 2;
  return std::sqrt(P_(k, k));
}

}  // namespace depthservo
