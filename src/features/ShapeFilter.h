#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "depth/byLastingErrors.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/features/DepthBlend.h"

namespace depthservo {

/// Extended Kalman filter of a shape in the image and of the 3D parameters that its motion needs,
/// with the exact flow of the Model; what InverseDepthFilter is for a point.
///
/// Model: `kStates` states, of which the image shows the first `kMeasured`, and
///   moved(Motion, state)      {x, F, L, isAhead}: the state after a motion, its derivative by the
///                             one before, and that of its rate by the camera's twist: kStates x 6
///   innovation(z, state)      kMeasured
///   start(z, chi, sigma)      {state, covariance} of a guess
///   centre(state)             where the shape's depth is meant
///   byChi(state)              derivative of centre(state).chi by the state: 1 x kStates
///   kGate                     of the normalised innovation squared: refuses 0.1 % of good ones
/// The errors of the odometry are treated as by InverseDepthFilter: white noise, rho for rest, and
/// the lasting ones considered, not estimated (Schmidt 1966). \rtsafe
template <typename Model>
class ShapeFilter {
 public:
  static constexpr int N = Model::kStates, M = Model::kMeasured;
  using State = Eigen::Matrix<double, N, 1>;
  using Square = Eigen::Matrix<double, N, N>;
  using Measured = Eigen::Matrix<double, M, 1>;

  /// Once it is started the depth starts anew, at the estimate.
  void setErrors(const ErrorProfile& errors) {
    errors_ = errors;
    lastingVariance_ = Lasting(errors).variance.transpose();
    if (!isStarted()) return;
    Z_guess_ = estimate().Z();
    startsAnew_ = true;
  }

  /// Where the depth is guessed to be [m]. Another than the guess before starts it anew.
  void setGuess(double Z) { startsAnew_ |= takeGuess(Z, Z_guess_); }

  void forget() {
    phase_ = Phase::unset;
    Z_guess_ = 1;
    startsAnew_ = false;
  }
  bool isStarted() const { return phase_ != Phase::unset; }
  const State& state() const { return x_; }
  const Square& covariance() const { return P_; }

  /// The first measurement, and one after a new guess, starts; others correct.
  void measure(const Measured& z, const Measured& variance) {
    if (startsAnew_ || !isStarted()) {
      start(z, variance);
    } else {
      correct(z, variance);
    }
  }

  void start(const Measured& z, const Measured& variance) {
    const DepthPrior usable = DepthPrior{Z_guess_}.sanitised(range_);
    const auto guess = Model::start(z, 1 / usable.Z, usable.sigma_chi);
    x_ = guess.x;
    P_ = guess.P;
    P_.template topLeftCorner<M, M>().diagonal() = variance;
    A_.setZero();
    rejections_ = 0;
    step_ = {};
    speed_.setZero();
    hasTwist_ = false;
    startsAnew_ = false;
    phase_ = Phase::measured;
  }

  void predict(const Motion& motion) {
    if (!isStarted() || !motion.isFinite() || !(motion.dt > 0)) return;
    const auto next = Model::moved(motion, x_);
    if (!next.isAhead || !next.x.allFinite()) {
      phase_ = Phase::behind;
      return;
    }
    step_ = errors_.odometry.over(motion);
    const GaussMarkov& slip = errors_.slip;
    if (slip.sigma > 0) {
      step_.variance_t +=
          slip.sigma * slip.sigma * motion.t.squaredNorm() * slip.asWhite(motion.dt);
    }
    x_ = next.x;
    const Rate& L = next.L;
    Square F = next.F;
    F.template topRightCorner<M, N - M>() *= step_.rho;
    P_ = F.lazyProduct(P_).eval().lazyProduct(F.transpose()).eval();
    const auto Lt = L.template leftCols<3>(), Lr = L.template rightCols<3>();
    P_ += step_.variance_t * Lt.lazyProduct(Lt.transpose());
    P_ += step_.variance_theta * Lr.lazyProduct(Lr.transpose());
    followLasting(motion, next.F, L);
    phase_ = Phase::coasting;
    if (motion.unknown.exists()) widen(motion.unknown);
  }

  void correct(const Measured& z, const Measured& variance) {
    const Measured innovation = Model::innovation(z, x_);
    if (isAdrift_ || phase_ == Phase::behind) return place(innovation, variance);
    Eigen::Matrix<double, M, M> S = P_.template topLeftCorner<M, M>();
    const Eigen::Matrix<double, M, 7> seen = A_.template topRows<M>();
    S += (seen * lastingVariance_.asDiagonal()).lazyProduct(seen.transpose());
    S.diagonal() += variance;
    const double nis = S.llt().matrixL().solve(innovation).squaredNorm();
    if (!(nis <= Model::kGate)) {
      phase_ = Phase::rejected;
      if (++rejections_ > kRejectionsInARow) place(innovation, variance);
      return;
    }
    update(innovation, variance * std::max(1., std::sqrt(nis) / kHuber));
    rejections_ = 0;
    phase_ = Phase::measured;
  }

  bool isMeasured() const { return phase_ == Phase::measured; }

  DepthEstimate estimate() const {
    if (!isStarted()) return {};
    const PointState c = Model::centre(x_);
    const Eigen::Matrix<double, 1, N> g = Model::byChi(x_);
    const Eigen::Matrix<double, 1, 7> lasting = g * A_;
    DepthEstimate e;
    e.x = c.x;
    e.y = c.y;
    e.chi = range_.clampChi(c.chi);
    const double common = (errors_.scale * errors_.scale + errors_.focal * errors_.focal) * e.chi;
    e.sigma_chi = std::sqrt(std::max(0., (g * P_).dot(g) + common * e.chi) +
                            lasting.cwiseAbs2().dot(lastingVariance_));
    e.sigma_xy = std::sqrt(std::max({P_(0, 0), P_(1, 1), 0.}));
    e.excitation = std::hypot(c.x * speed_.z() - speed_.x(), c.y * speed_.z() - speed_.y());
    e.status = status(e, c.chi);
    return e;
  }

 private:
  enum class Phase { unset, measured, coasting, rejected, behind };
  using Rate = Eigen::Matrix<double, N, 6>;
  using Lasting = detail::LastingErrors;
  static constexpr int kRejectionsInARow = 5;
  static constexpr double kHuber = 2.5, kLostSigma = 0.1;

  DepthStatus status(const DepthEstimate& e, double chi) const {
    if (phase_ == Phase::behind || (!isMeasured() && e.sigma_xy > kLostSigma)) {
      return DepthStatus::lost;
    }
    if (phase_ == Phase::coasting || !step_.isKnown) return DepthStatus::coasting;
    if (phase_ == Phase::rejected) return DepthStatus::rejected;
    if (!(step_.rho * speed_.squaredNorm() > 0)) return DepthStatus::unexcited;
    const bool isFound = range_.isFound(chi, e.sigma_chi);
    return isFound ? DepthStatus::valid : DepthStatus::converging;
  }

  /// The measurement says where the shape is, and nothing of its depth.
  void place(const Measured& innovation, const Measured& variance) {
    x_.template head<M>() += innovation;
    P_.template topLeftCorner<M, M>() = variance.asDiagonal();
    P_.template topRightCorner<M, N - M>().setZero();
    P_.template bottomLeftCorner<N - M, M>().setZero();
    A_.setZero();
    rejections_ = 0;
    isAdrift_ = false;
    phase_ = Phase::measured;
  }

  void widen(const UnknownPart& unknown) {
    const Eigen::Matrix<double, 1, N> g = Model::byChi(x_);
    const double sigma = std::sqrt(std::max(1e-18, (g * P_).dot(g)));
    const PointSigmas wide =
        widened({std::sqrt(std::max(0., P_(0, 0))), sigma}, Model::centre(x_), unknown);
    P_.template topLeftCorner<M, M>().diagonal().array() += wide.xy * wide.xy;
    const double grown = wide.chi / sigma;
    P_.template bottomRows<N - M>() *= grown;
    P_.template rightCols<N - M>() *= grown;
    isAdrift_ = true;
  }

  /// One measured number after the other, whose noises are independent: nothing is inverted.
  void update(Measured innovation, const Measured& variance) {
    for (int i = 0; i < M; ++i) {
      const State PH = P_.col(i);
      const double s = PH[i] + variance[i];
      const State K = PH / s;
      const Eigen::Matrix<double, 1, 7> seen = A_.row(i);
      x_ += K * innovation[i];
      innovation -= K.template head<M>() * double(innovation[i]);
      P_ -= K.lazyProduct(PH.transpose());
      A_ -= K.lazyProduct(seen);
    }
    P_ = (.5 * (P_ + P_.transpose())).eval();
  }

  void followLasting(const Motion& motion, const Square& F, const Rate& L) {
    const Twist twist = motion.twist();
    const Vector6d now = twist.vector();
    speed_ = twist.linear;
    A_ = F.lazyProduct(A_).eval();
    if (hasTwist_) A_.col(Lasting::kLatency) -= L.lazyProduct(now - twist_);
    A_.template middleCols<3>(Lasting::kBias) -= motion.dt * L.template rightCols<3>();
    A_.template middleCols<3>(Lasting::kMount) += motion.dt * detail::byMount(L, twist);
    twist_ = now;
    hasTwist_ = true;
  }

  ErrorProfile errors_ = ErrorProfile::arm();
  Eigen::Matrix<double, 7, 1> lastingVariance_ = Lasting(errors_).variance.transpose();
  DepthRange range_;
  State x_ = State::Zero();
  Square P_ = Square::Identity();
  Eigen::Matrix<double, N, 7> A_ = Eigen::Matrix<double, N, 7>::Zero();  // by the lasting errors
  OdometryNoise::Step step_;                                             // of the last motion
  Eigen::Vector3d speed_ = Eigen::Vector3d::Zero();
  Vector6d twist_ = Vector6d::Zero();
  bool hasTwist_ = false, isAdrift_ = false;
  int rejections_ = 0;  // in a row
  double Z_guess_ = 1;
  bool startsAnew_ = false;  // there was another guess
  Phase phase_ = Phase::unset;
};

}  // namespace depthservo
