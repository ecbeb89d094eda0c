#include "depthservo/depth/NonlinearDepthObserver.h"

#include <algorithm>
#include <cmath>

namespace depthservo {

using namespace detail;

ObserverGains ObserverGains::fromSettlingTime(double settling_s, double W0) {
  const double wn = kSettling / settling_s;
  return {2 * wn, wn * wn / (W0 * W0), 0, wn};
}

ObserverGains ObserverGains::scheduled(double settling_s, double W_min) {
  const double wn = kSettling / settling_s;
  return {2 * wn, wn * wn / (W_min * W_min), W_min, wn};
}

NonlinearDepthObserver::NonlinearDepthObserver(const Options& options, const DepthRange& range)
    : options_(options), range_(range) {}

std::unique_ptr<DepthEstimator> NonlinearDepthObserver::clone() const {
  return std::make_unique<NonlinearDepthObserver>(*this);
}

void NonlinearDepthObserver::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  const DepthPrior usable = prior.sanitised(range_);
  *this = NonlinearDepthObserver(options_, range_);
  point_ = {measurement.x, measurement.y, 1 / usable.Z};
  variance_ = {measurement.sigma * measurement.sigma, 0, usable.sigma_chi * usable.sigma_chi};
  predicted_ = variance_;
  phase_ = Phase::measured;
}

void NonlinearDepthObserver::predict(const Motion& motion) {
  if (phase_ == Phase::unset || phase_ == Phase::gone || !motion.isUsable()) return;
  isMotionKnown_ = !motion.unknown.exists();
  const Flow next = flow(motion, point_);
  const Eigen::Vector3d J_next_chi =
      flowDerivative(motion, point_, next.point, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d J_point_chi = flowDerivative(motion, point_, next.point, J_point_chi_);
  const double W = J_next_chi.head<2>().norm() / motion.dt;
  if (!next.ahead || !(J_point_chi.lpNorm<1>() + W < kBeyondSense)) {
    phase_ = Phase::gone;
    return;
  }
  W_ = W;
  J_point_chi_ = J_point_chi;
  elapsed_s_ += motion.dt;
  const OdometryNoise::Step noise = options_.odometry.over(motion);
  rho_ = std::min(rho_, noise.rho);
  odometryVariance_ += noise.variance_t * point_.chi * point_.chi +
                       noise.variance_theta * (1 + point_.x * point_.x + point_.y * point_.y);
  point_ = next.point;
  point_.chi = range_.clampChi(point_.chi);

  const double W2 = noise.rho * W * W;
  const double decayRate = options_.gains.wn2At(W2) / options_.gains.k;
  window_.add(W2, decayRate, motion.dt, options_.window_s);

  predicted_ = predictedVariance();
  if (motion.unknown.exists()) letDrift(motion.unknown);
  const bool isVague = predicted_.ll > square(options_.lost_sigma);
  phase_ = isVague ? Phase::vague : Phase::coasting;
}

/// What is not known of the motion teaches nothing: no parallax is left of it.
void NonlinearDepthObserver::letDrift(const UnknownPart& unknown) {
  const PointSigmas sigmas{std::sqrt(std::max(0.0, predicted_.ll)),
                           std::sqrt(std::max(0.0, predicted_.cc))};
  const PointSigmas wide = widened(sigmas, point_, unknown);
  variance_ = predicted_ = {square(wide.xy), 0, square(wide.chi)};
  J_point_chi_ = Eigen::Vector3d::UnitZ();
  elapsed_s_ = odometryVariance_ = 0;
  rho_ = 1;
  isAdrift_ = true;
}

LineVariance NonlinearDepthObserver::predictedVariance() const {
  return variance_.predicted(J_point_chi_.head<2>().norm(), J_point_chi_.z(), odometryVariance_);
}

void NonlinearDepthObserver::correct(const PointMeasurement& measurement) {
  if (phase_ == Phase::unset) return;
  if (!measurement.isUsable()) {
    if (phase_ != Phase::gone) phase_ = Phase::rejected;
    return;
  }
  if (phase_ == Phase::gone) return reset(measurement, {1 / point_.chi});
  if (isAdrift_) {
    const bool isMotionKnown = isMotionKnown_;
    reset(measurement, {1 / point_.chi, std::sqrt(predicted_.cc)});
    isMotionKnown_ = isMotionKnown;
    return;
  }
  const double r = measurement.sigma * measurement.sigma;
  const LineVariance P = predicted_;
  const Eigen::Vector2d nu(measurement.x - point_.x, measurement.y - point_.y);
  const double gate2 = squaredGate(options_.gate, options_.gate_sigma, P.ll + r);
  if (!(nu.squaredNorm() <= gate2)) {
    phase_ = Phase::rejected;
    if (++rejections_ > options_.rejectionsInARow) reset(measurement, {1 / point_.chi});
    return;
  }
  rejections_ = 0;
  if (!(elapsed_s_ > 0)) return;  // a second measurement of the same instant

  const Eigen::Vector2d b = J_point_chi_.head<2>();
  const double B = b.norm();
  const double W2 = square(B / elapsed_s_);
  gains_.match(options_.gains.k, options_.gains.wn2At(W2), elapsed_s_);
  const double perLine = 1 / B;
  const double chiPerLine = B > kNoExcitation * elapsed_s_ ? rho_ * gains_.chi * perLine : 0;

  point_.x += gains_.point * nu.x();
  point_.y += gains_.point * nu.y();
  if (chiPerLine > 0) point_.chi = range_.clampChi(point_.chi + chiPerLine * b.dot(nu) * perLine);

  variance_ = P.corrected(gains_.point, chiPerLine, r);
  if (!(variance_.ll + variance_.cc < kBeyondSense)) {
    return reset(measurement, {1 / point_.chi});
  }
  predicted_ = variance_;
  J_point_chi_ = Eigen::Vector3d::UnitZ();
  elapsed_s_ = 0;
  rho_ = 1;
  odometryVariance_ = 0;
  phase_ = Phase::measured;
}

void NonlinearDepthObserver::correctDepth(const DepthPrior& measured) {
  if (phase_ == Phase::unset || !measured.isUsable()) return;
  const double R = measured.sigma_chi * measured.sigma_chi;
  const double gain = R > 0 ? predicted_.cc / (predicted_.cc + R) : 1;
  point_.chi = range_.clampChi(point_.chi + gain * (1 / measured.Z - point_.chi));
  variance_.cc *= 1 - gain;
  variance_.lc *= 1 - gain;
  predicted_ = predictedVariance();
}

bool NonlinearDepthObserver::isExcited() const { return W_ > kNoExcitation && window_.isExcited(); }

DepthEstimate NonlinearDepthObserver::estimate() const {
  if (phase_ == Phase::unset) return {};
  DepthEstimate e;
  e.x = point_.x;
  e.y = point_.y;
  e.chi = point_.chi;
  e.sigma_chi = std::min(std::sqrt(std::max(0.0, predicted_.cc)), DepthPrior::kLargestSigma_chi);
  e.sigma_xy = std::min(std::sqrt(std::max(0.0, predicted_.ll)), PointMeasurement::kLargestSigma);
  e.excitation = W_;
  e.status = statusOf(phase_, isExcited(), range_.isFound(e.chi, e.sigma_chi));
  if (!isMotionKnown_) e.status = whileMotionIsUnknown(e.status);
  return e;
}

}  // namespace depthservo
