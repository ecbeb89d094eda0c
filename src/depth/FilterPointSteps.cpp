#include "depth/FilterPointSteps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "depthservo/depth/DepthForecast.h"

namespace depthservo::detail {
namespace {

using Phase = FilterPoint::Phase;

/// Share by which sigma_chi must be about to fall within a second for motion to count.
constexpr double kTellingShare = 0.05;

/// Relative sigma below which a depth is not expected to get better by kTellingShare a second.
constexpr double kWellKnown = 0.01;

/// No direct measurement of a depth is believed to be better than this share of it.
constexpr double kBestDepth = 1e-3;

/// Excitations are reported up to this [m/s].
constexpr double kLargestSpeed = 1e9;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What the considered uncertainties add to the variances; bounded, whatever the sensitivities.
ConsideredVariances considered(const FilterPoint& p, const InverseDepthFilterOptions& options,
                               const ConsideredVariances& more) {
  const auto variance = [&](int i, double others) {
    const double s = options.odometryScaleSigma > 0 ? options.odometryScaleSigma * p.scale[i] : 0;
    const double f = options.focalSigma > 0 ? options.focalSigma * p.focal[i] : 0;
    const double sum = s * s + f * f + others;
    return sum < kLargestVariance ? sum : kLargestVariance;
  };
  return {variance(0, more.xx), 0, variance(1, more.yy), variance(2, more.cc)};
}

void propagate(double (&e)[3], const FlowDerivative<double>& F) {
  const double x = F.xx * e[0] + F.xy * e[1] + F.xc * e[2];
  const double y = F.yx * e[0] + F.yy * e[1] + F.yc * e[2];
  const double c = F.cx * e[0] + F.cy * e[1] + F.cc * e[2];
  e[0] = x;
  e[1] = y;
  e[2] = c;
}

/// e <- e + K (nu_x, nu_y), nu the change of the innovation.
void correctSensitivity(double (&e)[3], const FilterGain<double>& K, double nu_x, double nu_y) {
  e[0] += K.xx * nu_x + K.xy * nu_y;
  e[1] += K.yx * nu_x + K.yy * nu_y;
  e[2] += K.cx * nu_x + K.cy * nu_y;
}

/// NIS when the innovation also varies with the considered parameters.
double consideredNis(const FilterPoint& p, const FilterInnovation<double>& nu, double r,
                     const InverseDepthFilterOptions& options, const ConsideredVariances& more) {
  const double s2 = options.odometryScaleSigma * options.odometryScaleSigma;
  const double f2 = options.focalSigma * options.focalSigma;
  const double sx = p.scale[0], sy = p.scale[1], fx = p.x - p.focal[0], fy = p.y - p.focal[1];
  const double a = p.xx + r + s2 * sx * sx + f2 * fx * fx + more.xx;
  const double b = p.xy + s2 * sx * sy + f2 * fx * fy + more.xy;
  const double c = p.yy + r + s2 * sy * sy + f2 * fy * fy + more.yy;
  return nisOf(a, b, c, nu.x, nu.y);
}

/// What is not known of the bias by measured odometry noise: a share of it, as the level of the
/// noise is not known exactly, and more of its square, the next order.
double biasVariance(const FilterPoint& p) {
  constexpr double kShare = 0.3, kOfSquare = 4;
  const double bias2 = p.bias * p.bias, chi2 = p.chi * p.chi;
  const double relative2 = bias2 < chi2 ? bias2 / chi2 : 1;
  return std::min(bias2 * (kShare + kOfSquare * relative2), kLargestVariance);
}

}  // namespace

double measurementVariance(double sigma) {
  constexpr double kSmallest = 1e-14;
  return std::max(sigma * sigma, kSmallest);
}

double depthVariance(double chi, double sigma_chi) {
  const double sigma = std::max(sigma_chi, kBestDepth * chi);
  return std::min(sigma * sigma, kLargestVariance);
}

Verdict judge(FilterPoint& p, double nis, const InverseDepthFilterOptions& options) {
  if (p.phase == Phase::behind) return Verdict::restart;
  if (nis >= 0 && nis <= options.gate) {
    p.rejections = 0;
    p.accepted = static_cast<unsigned char>(std::min(p.accepted + 1, kYoung));
    return Verdict::use;
  }
  ++p.rejections;
  const bool isYoung = p.accepted < kYoung;
  if (p.rejections > (isYoung ? 1 : 2 * options.rejectionsInARow)) return Verdict::restart;
  const bool isNumber = nis >= 0 && nis < kLargestVariance;
  return isNumber && p.rejections > options.rejectionsInARow ? Verdict::use : Verdict::reject;
}

double weighted(double r, double nis, const InverseDepthFilterOptions& options) {
  return nis > options.huber * options.huber ? r * std::sqrt(nis) / options.huber : r;
}

void resetPoint(FilterPoint& p, const PointMeasurement& measurement,
                const DepthPrior& usablePrior) {
  p = {};
  p.x = p.focal[0] = measurement.x;
  p.y = p.focal[1] = measurement.y;
  p.chi = 1 / usablePrior.Z;
  p.r = measurementVariance(measurement.sigma);
  p.xx = p.yy = std::min(p.r, kLargestVariance);
  // A guess, unlike a measurement, must not exclude that the point is far away.
  const double sigma_chi = usablePrior.sigma_chi < DepthPrior::kWideSigma_chi
                               ? usablePrior.sigma_chi
                               : std::max(usablePrior.sigma_chi, p.chi);
  p.cc = std::min(sigma_chi * sigma_chi, kLargestVariance);
  p.phase = Phase::measured;
}

void rejoinPoint(FilterPoint& p, const PointMeasurement& measurement) {
  p.x = p.focal[0] = measurement.x;
  p.y = p.focal[1] = measurement.y;
  p.scale[0] = p.scale[1] = 0;
  p.r = measurementVariance(measurement.sigma);
  p.xx = p.yy = std::min(p.r, kLargestVariance);
  p.xy = p.xc = p.yc = 0;
  p.phase = Phase::measured;
}

void letDrift(FilterPoint& p, const UnknownPart& unknown) {
  const double sigma_xy = std::sqrt(std::max({p.xx, p.yy, 0.}));
  const PointSigmas wide = widened({sigma_xy, std::sqrt(std::max(p.cc + biasVariance(p), 0.))},
                                   {p.x, p.y, p.chi}, unknown);
  p.xx = p.yy = wide.xy * wide.xy;
  p.cc = std::min(wide.chi * wide.chi, kLargestVariance);
  p.xy = p.xc = p.yc = p.noise_t = p.noise_xy = p.bias = 0;
  p.accepted = 0;
  p.rejections = 0;
  p.phase = Phase::adrift;
}

void predictPoint(FilterPoint& p, const FilterStep& step,
                  const InverseDepthFilterOptions& options) {
  if (p.phase == Phase::unset || p.phase == Phase::behind) return;
  const FilterState<double> before = stateOf(p);
  Prediction<double> next{};
  predictState(step, before, next);
  if (!(next.q3 > 0 && next.size < kLargestVariance)) {
    p.phase = Phase::behind;
    return;
  }
  const FlowDerivative<double>& F = next.F;
  if (options.odometryScaleSigma > 0) {
    propagate(p.scale, F);
    p.scale[0] += before.c * F.xc;
    p.scale[1] += before.c * F.yc;
    p.scale[2] += before.c * F.cc - next.state.c;
  }
  if (options.focalSigma > 0) propagate(p.focal, F);
  setState(p, next.state);
  p.parallax2 = F.xc * F.xc + F.yc * F.yc;
  if (p.phase != Phase::adrift) p.phase = Phase::coasting;
  if (step.unknown.exists()) letDrift(p, step.unknown);
}

PointCorrection correctPoint(FilterPoint& p, const PointMeasurement& measurement,
                             const InverseDepthFilterOptions& options, const DepthRange& range,
                             const ConsideredVariances& more) {
  PointCorrection done;
  if (p.phase == Phase::unset) return done;
  if (!measurement.isUsable()) {
    if (p.phase != Phase::behind && p.phase != Phase::adrift) p.phase = Phase::rejected;
    return done;
  }
  if (p.phase == Phase::adrift) {
    rejoinPoint(p, measurement);
    done.verdict = Verdict::restart;
    return done;
  }
  const double r = measurementVariance(measurement.sigma);
  FilterState<double> s = stateOf(p);
  FilterInnovation<double> nu{};
  innovate(s, measurement.x, measurement.y, r, nu);
  const bool isOwn = options.odometryScaleSigma > 0 || options.focalSigma > 0;
  const bool isConsidered = isOwn || more.xx > 0 || more.yy > 0;
  const double nis = !(nu.det > 0)  ? kInfinity
                     : isConsidered ? consideredNis(p, nu, r, options, more)
                                    : nu.nis;
  done.verdict = judge(p, nis, options);
  if (done.verdict == Verdict::restart) resetPoint(p, measurement, {1 / range.clampChi(p.chi)});
  if (done.verdict == Verdict::reject) p.phase = Phase::rejected;
  if (done.verdict != Verdict::use) return done;
  FilterGain<double>& K = done.gain;
  correctState(s, nu, weighted(r, nis, options), K);
  if (isOwn) {
    correctSensitivity(p.scale, K, -p.scale[0], -p.scale[1]);
    correctSensitivity(p.focal, K, measurement.x - p.focal[0], measurement.y - p.focal[1]);
  }
  setState(p, s);
  p.r = r;
  p.phase = Phase::measured;
  return done;
}

void correctPointDepth(FilterPoint& p, const DepthPrior& usable, const DepthRange& range) {
  if (p.phase == Phase::unset || p.phase == Phase::behind) return;
  const double measured = range.clampChi(1 / usable.Z);
  const double variance = depthVariance(measured, usable.sigma_chi);
  const double sum = p.cc + variance;
  const double gain = sum > 0 ? 1 / sum : 0;
  const double Kx = p.xc * gain, Ky = p.yc * gain, Kc = sum > 0 ? p.cc * gain : 0;
  const double nu = measured - p.chi;
  p.x += Kx * nu;
  p.y += Ky * nu;
  p.chi += Kc * nu;
  for (double(*e)[3] : {&p.scale, &p.focal}) {
    const double ec = (*e)[2];
    (*e)[0] -= Kx * ec;
    (*e)[1] -= Ky * ec;
    (*e)[2] -= Kc * ec;
  }
  p.xx = std::max(p.xx - Kx * p.xc, kLeastShare * p.xx);
  p.yy = std::max(p.yy - Ky * p.yc, kLeastShare * p.yy);
  p.xy -= Kx * p.yc;
  const double left = variance * gain;  // 1 - Kc, without cancellation
  p.xc *= left;
  p.yc *= left;
  p.cc = std::max(p.cc * left, kLeastShare * p.cc);
  p.bias *= left;
}

DepthEstimate describePoint(const FilterPoint& p, const OdometryNoise::Step& noise, double dt,
                            const InverseDepthFilterOptions& options, const DepthRange& range,
                            const ConsideredVariances& more) {
  if (p.phase == Phase::unset) return {};
  const ConsideredVariances extra = considered(p, options, more);
  DepthEstimate e;
  e.x = p.x;
  e.y = p.y;
  e.chi = range.clampChi(p.chi);
  e.sigma_chi = std::sqrt(std::max(p.cc + biasVariance(p) + extra.cc, 0.));
  e.sigma_xy = std::sqrt(std::max({p.xx + extra.xx, p.yy + extra.yy, 0.}));
  const double parallax = std::sqrt(p.parallax2);
  e.excitation = dt > 0 ? std::min(parallax / dt, kLargestSpeed) : 0;
  const auto excited = [&] {
    const double sigma2 = std::max(p.cc, kWellKnown * kWellKnown * e.chi * e.chi);
    const DepthForecast forecast{noise.rho * parallax, std::sqrt(p.r), noise.variance_t,
                                 noise.variance_theta};
    return dt > 0 && forecast.tells(kTellingShare, e.chi, sigma2, std::max(1., 1 / dt));
  };
  switch (p.phase) {
    case Phase::behind:
      e.status = DepthStatus::lost;
      break;
    case Phase::coasting:
    case Phase::adrift:
      e.status = e.sigma_xy > options.lost_sigma ? DepthStatus::lost : DepthStatus::coasting;
      break;
    case Phase::rejected:
      e.status = e.sigma_xy > options.lost_sigma ? DepthStatus::lost : DepthStatus::rejected;
      break;
    default:
      e.status = !excited()                          ? DepthStatus::unexcited
                 : range.isFound(e.chi, e.sigma_chi) ? DepthStatus::valid
                                                     : DepthStatus::converging;
  }
  if (!noise.isKnown) e.status = whileMotionIsUnknown(e.status);
  return e;
}

}  // namespace depthservo::detail
