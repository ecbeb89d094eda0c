#include "depthservo/depth/NonlinearDepthObserver.h"

#include <algorithm>
#include <cmath>

#include "depth/poleMatched.h"

namespace depthservo {
namespace {

/// wn times the settling time to 2 % of s^2 + 2 wn s + wn^2.
constexpr double kSettling = 5.83;

/// Excitation [m/s] below which the camera does not translate across the line of sight at all.
constexpr double kNoExcitation = 1e-9;

/// Speeds [m/s] and derivatives of the flow beyond which a motion is nonsense: squares stay finite.
constexpr double kBeyondSense = 1e9;

/// No camera sees a point farther from its prediction than this (84 degrees off its axis).
constexpr double kLargestInnovation = 10;

double square(double a) { return a * a; }

}  // namespace

ObserverGains ObserverGains::fromSettlingTime(double settling_s, double W0) {
  const double wn = kSettling / settling_s;
  return {2 * wn, wn * wn / (W0 * W0), 0, wn};
}

ObserverGains ObserverGains::scheduled(double settling_s, double W_min) {
  const double wn = kSettling / settling_s;
  return {2 * wn, wn * wn / (W_min * W_min), W_min, wn};
}

void NonlinearDepthObserver::PoleMatchedGains::match(double k, double squaredFrequency,
                                                     double duration_s) {
  if (duration_s == Dt && squaredFrequency == wn2) return;
  Dt = duration_s;
  wn2 = squaredFrequency;
  point = -std::expm1(-k * Dt);
  chi = poleMatchedGain(k, wn2, Dt);
}

double NonlinearDepthObserver::WindowShare::of(double duration_s, double window_s) {
  if (duration_s != dt) {
    dt = duration_s;
    share = -std::expm1(-dt / window_s);
  }
  return share;
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
  const double seen = windowShare_.of(motion.dt, options_.window_s);
  J_ += seen * (W2 * options_.window_s - J_);
  windowedDecay_ += seen * (decayRate * options_.window_s - windowedDecay_);
  windowFilled_ += seen * (1 - windowFilled_);

  predicted_ = predictedVariance();
  const bool isVague = predicted_.ll > square(options_.lost_sigma);
  phase_ = isVague ? Phase::vague : Phase::coasting;
}

NonlinearDepthObserver::LineVariance NonlinearDepthObserver::predictedVariance() const {
  const double B = J_point_chi_.head<2>().norm();
  const double g = J_point_chi_.z();
  const auto& [ll, lc, cc] = variance_;
  return {ll + B * (2 * lc + B * cc) + odometryVariance_, g * (lc + B * cc), g * g * cc};
}

void NonlinearDepthObserver::correct(const PointMeasurement& measurement) {
  if (phase_ == Phase::unset) return;
  if (!measurement.isUsable()) {
    if (phase_ != Phase::gone) phase_ = Phase::rejected;
    return;
  }
  if (phase_ == Phase::gone) return reset(measurement, {1 / point_.chi});
  const double r = measurement.sigma * measurement.sigma;
  const LineVariance P = predicted_;
  const Eigen::Vector2d nu(measurement.x - point_.x, measurement.y - point_.y);
  const double gate2 =
      std::min(std::max(square(options_.gate), square(options_.gate_sigma) * (P.ll + r)),
               square(kLargestInnovation));
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

  const double keep = 1 - gains_.point;
  variance_ = {keep * keep * P.ll + gains_.point * gains_.point * r,
               keep * (P.lc - chiPerLine * P.ll) + gains_.point * chiPerLine * r,
               P.cc - 2 * chiPerLine * P.lc + chiPerLine * chiPerLine * (P.ll + r)};
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

bool NonlinearDepthObserver::isExcited() const {
  return W_ > kNoExcitation && windowFilled_ > 0 && windowedDecay_ >= windowFilled_;
}

DepthEstimate NonlinearDepthObserver::estimate() const {
  if (phase_ == Phase::unset) return {};
  DepthEstimate e;
  e.x = point_.x;
  e.y = point_.y;
  e.chi = point_.chi;
  e.sigma_chi = std::min(std::sqrt(std::max(0.0, predicted_.cc)), DepthPrior::kLargestSigma_chi);
  e.sigma_xy = std::min(std::sqrt(std::max(0.0, predicted_.ll)), PointMeasurement::kLargestSigma);
  e.excitation = W_;
  switch (phase_) {
    case Phase::vague:
    case Phase::gone:
      e.status = DepthStatus::lost;
      break;
    case Phase::coasting:
      e.status = DepthStatus::coasting;
      break;
    case Phase::rejected:
      e.status = DepthStatus::rejected;
      break;
    default:
      e.status = !isExcited()                                ? DepthStatus::unexcited
                 : e.sigma_chi < kValidRelativeSigma * e.chi ? DepthStatus::valid
                                                             : DepthStatus::converging;
  }
  return e;
}

}  // namespace depthservo
