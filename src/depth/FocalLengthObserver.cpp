#include "depthservo/depth/FocalLengthObserver.h"

#include <algorithm>
#include <cmath>

#include "depth/poleMatched.h"

namespace depthservo {
namespace {

/// Natural frequency of 1/lambda over that of lambda: an error of 1/lambda holds up that of lambda.
constexpr double kInverseFaster = 3;

/// What the product of lambda and 1/lambda may differ from 1 in a valid estimate.
constexpr double kConsistent = 0.1;

/// Variances beyond which the estimate starts anew.
constexpr double kLargestVariance = 1e12;

using detail::kSettling;
using detail::square;

/// Eigenvalues of a symmetric matrix, ascending; the smaller by the determinant, so that it is
/// not lost beside a large one.
struct Eigenvalues {
  double low = 0, high = 0;
  explicit Eigenvalues(const Eigen::Matrix2d& M) {
    const double mean = 0.5 * (M(0, 0) + M(1, 1));
    high = mean + std::hypot(0.5 * (M(0, 0) - M(1, 1)), M(0, 1));
    const double determinant = M(0, 0) * M(1, 1) - M(0, 1) * M(1, 0);
    low = high > 0 ? std::max(0.0, determinant / high) : 0;
  }
};

/// f(wn2) = (1 - p1)(1 - p2)/(wn2 Dt), also in the limit wn2 = 0.
double matched(double k, double wn2, double Dt) {
  const double tiny = 1e-12 * k * k;
  const double safe = std::max(wn2, tiny);
  return poleMatchedGain(k, safe, Dt) / (safe * Dt);
}

}  // namespace

FocalGains FocalGains::fromSettlingTime(double settling_s, double turnRate, double radius_px) {
  const double wn2 = square(kSettling / settling_s);
  // Root mean square of |c| for axes in all directions.
  const double c = radius_px * radius_px * turnRate / std::sqrt(2.0);
  return {2 * std::sqrt(wn2), wn2 / square(turnRate), square(kInverseFaster) * wn2 / square(c)};
}

FocalLengthObserver::FocalLengthObserver(const Options& options) : options_(options) {}

void FocalLengthObserver::reset(const CentredPixel& measured, double focal_px) {
  if (!measured.isUsable()) return;
  *this = FocalLengthObserver(options_);
  if (focal_px >= options_.range.smallest_px && focal_px <= options_.range.largest_px) {
    lambda_ = {focal_px, 1 / focal_px};
  }
  restart(measured);
}

/// With the focal length at hand, but without trust in it.
void FocalLengthObserver::restart(const CentredPixel& measured) {
  covariance_ =
      Eigen::Vector4d(0, 0, square(options_.sigma_focal_px), square(options_.sigma_inverseFocal))
          .asDiagonal();
  startFrom(measured);
}

void FocalLengthObserver::resume(const CentredPixel& measured) {
  if (phase_ != Phase::unset && measured.isUsable()) startFrom(measured);
}

void FocalLengthObserver::startFrom(const CentredPixel& measured) {
  y_ = {measured.y1, measured.y2};
  covariance_.topRows<2>().setZero();
  covariance_.leftCols<2>().setZero();
  covariance_(0, 0) = covariance_(1, 1) = square(measured.sigma);
  R_.setIdentity();
  elapsed_s_ = 0;
  rejections_ = 0;
  phase_ = Phase::measured;
}

FocalLengthObserver::Prediction FocalLengthObserver::predicted() const {
  Prediction p;
  const Eigen::Matrix3d& R = R_;
  const double tilt = R(2, 0) * y_.x() + R(2, 1) * y_.y();
  const double q3 = tilt * lambda_.y() + R(2, 2);
  const double scale = 1 / q3;
  p.y = scale * (R.topLeftCorner<2, 2>() * y_ + lambda_.x() * R.topRightCorner<2, 1>());
  p.B.col(0) = scale * R.topRightCorner<2, 1>();
  p.B.col(1) = -scale * tilt * p.y;
  p.ahead = q3 > 0 && p.y.lpNorm<1>() < kLargestVariance && p.B.lpNorm<1>() < kLargestVariance;
  return p;
}

Eigen::Matrix4d FocalLengthObserver::predictedCovariance(const Eigen::Matrix2d& B) const {
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F.topRightCorner<2, 2>() = B;
  return F * covariance_ * F.transpose();
}

void FocalLengthObserver::predict(const Motion& motion) {
  if (phase_ == Phase::unset || phase_ == Phase::gone || !motion.isUsable()) return;
  if (motion.unknown.exists()) {  // the next measurement says where the point is, no more
    phase_ = Phase::gone;
    return;
  }
  const Prediction before = predicted();
  R_ = motion.R * R_;
  elapsed_s_ += motion.dt;
  const Prediction now = predicted();
  if (!before.ahead || !now.ahead) {
    phase_ = Phase::gone;
    return;
  }
  phase_ = Phase::coasting;

  const double wx = motion.R(1, 2) / motion.dt, wy = -motion.R(0, 2) / motion.dt;
  const Eigen::Vector2d y = 0.5 * (before.y + now.y);
  eta1_ = y.x() * wx + y.y() * wy;
  eta2_ = y.y() * wx - y.x() * wy;
  Eigen::Matrix2d Omega;
  Omega << -wy, wx, y.x() * eta2_, y.y() * eta2_;
  const double seen = -std::expm1(-motion.dt / options_.window_s);
  gramian_ += seen * (options_.window_s * Omega * Omega.transpose() - gramian_);
  windowFilled_ += seen * (1 - windowFilled_);
}

void FocalLengthObserver::correct(const CentredPixel& measured) {
  if (phase_ == Phase::unset) return;
  if (!measured.isUsable()) {
    if (phase_ != Phase::gone) phase_ = Phase::rejected;
    return;
  }
  if (phase_ == Phase::gone) return startFrom(measured);
  const Prediction now = predicted();
  const Eigen::Matrix4d P = predictedCovariance(now.B);
  const double r = square(measured.sigma);
  const Eigen::Vector2d nu = Eigen::Vector2d(measured.y1, measured.y2) - now.y;
  const double gate2 =
      std::max(square(options_.gate_px), square(options_.gate_sigma) * (P(0, 0) + P(1, 1) + r));
  if (!(nu.squaredNorm() <= gate2)) {
    phase_ = Phase::rejected;
    if (++rejections_ > options_.rejectionsInARow) restart(measured);
    return;
  }
  rejections_ = 0;
  if (!(elapsed_s_ > 0)) return;  // a second measurement of the same instant

  const FocalGains& gains = options_.gains;
  const Eigen::Vector2d D(std::sqrt(gains.k_3), std::sqrt(gains.k_4));
  const Eigen::Matrix2d W = now.B * D.asDiagonal() / elapsed_s_;
  const Eigen::Matrix2d WWt = W * W.transpose();
  const Eigenvalues wn2(WWt);
  const double high = matched(gains.k, wn2.high, elapsed_s_);
  const double low = matched(gains.k, wn2.low, elapsed_s_);
  // f(W W^T) = a I + b W W^T agrees with f at both eigenvalues.
  const double gap = wn2.high - wn2.low;
  const double b = gap > 1e-12 * wn2.high ? (high - low) / gap : 0;
  const double a = low - b * wn2.low;

  Eigen::Matrix<double, 4, 2> L;
  L.topRows<2>() = -std::expm1(-gains.k * elapsed_s_) * Eigen::Matrix2d::Identity();
  L.bottomRows<2>() = D.asDiagonal() * W.transpose() * (a * Eigen::Matrix2d::Identity() + b * WWt);

  Eigen::Matrix4d keep = Eigen::Matrix4d::Identity();
  keep.leftCols<2>() -= L;
  y_ = now.y + L.topRows<2>() * nu;
  lambda_ += L.bottomRows<2>() * nu;
  lambda_.x() = std::clamp(lambda_.x(), 0.0, options_.range.largest_px);
  lambda_.y() = std::clamp(lambda_.y(), 0.0, 1 / options_.range.smallest_px);
  covariance_ = keep * P * keep.transpose() + r * L * L.transpose();
  R_.setIdentity();
  elapsed_s_ = 0;
  phase_ = Phase::measured;
  if (!(covariance_.diagonal().sum() < kLargestVariance)) restart(measured);
}

double FocalLengthObserver::informationOnFocal() const {
  const double own = gramian_(0, 0), shared = gramian_(0, 1), inverse = gramian_(1, 1);
  return inverse > 0 ? std::max(0.0, own - shared * (shared / inverse)) : own;
}

FocalEstimate FocalLengthObserver::estimate() const {
  FocalEstimate e;
  if (phase_ == Phase::unset) return e;
  const Prediction now = predicted();
  const Eigen::Vector2d y = now.ahead ? now.y : y_;
  e.y1 = y.x();
  e.y2 = y.y();
  e.focal_px = lambda_.x();
  e.inverseFocal = lambda_.y();
  e.sigma_focal_px = std::sqrt(std::max(0.0, covariance_(2, 2)));
  e.eta1 = eta1_;
  e.eta2 = eta2_;
  e.sigma_min = Eigenvalues(gramian_).low;
  const double seen_s = options_.window_s * windowFilled_;
  e.decayRate =
      seen_s > 0 ? options_.gains.k_3 * informationOnFocal() / (options_.gains.k * seen_s) : 0;
  const bool isSure = e.focal_px > 0 && e.sigma_focal_px < kValidRelativeSigma * e.focal_px &&
                      std::abs(e.consistency() - 1) < kConsistent;
  const bool isExcited = e.decayRate * options_.slowest_s > 1;
  e.status = detail::statusOf(phase_, isExcited, isSure);
  return e;
}

double compensatedFocal(double focal_px, double lever_m, double Z) {
  return focal_px / (1 + lever_m / Z);
}

}  // namespace depthservo
