#pragma once

#include "depthservo/motion/OdometryNoise.h"

/// The arithmetic of InverseDepthFilter, for T = double or a vector of doubles: no branches, one
/// place. Names: c is chi; `xy` of a covariance is that of x and y.
namespace depthservo::detail {

#define DEPTHSERVO_INLINE __attribute__((always_inline)) inline

/// A camera motion as the kernel reads it.
struct FilterStep {
  double R11, R12, R13, R21, R22, R23, R31, R32, R33, t1, t2, t3;
  double variance_t, variance_theta, rho, bias_variance;
  UnknownPart unknown;

  FilterStep(const Motion& m, const OdometryNoise::Step& noise)
      : R11(m.R(0, 0)),
        R12(m.R(0, 1)),
        R13(m.R(0, 2)),
        R21(m.R(1, 0)),
        R22(m.R(1, 1)),
        R23(m.R(1, 2)),
        R31(m.R(2, 0)),
        R32(m.R(2, 1)),
        R33(m.R(2, 2)),
        t1(m.t(0)),
        t2(m.t(1)),
        t3(m.t(2)),
        variance_t(noise.variance_t),
        variance_theta(noise.variance_theta),
        rho(noise.rho),
        bias_variance(noise.bias_variance),
        unknown(m.unknown) {}
};

/// No update can be trusted to leave less of a variance than this share: rounding.
constexpr double kLeastShare = 1e-15;

/// Measured noise is at first taken to have half of the declared variance; that weighs as much as
/// one innovation that consists of it.
constexpr double kFirstLevel = 0.5, kLevelWeight = 4;

/// What measured translation noise does to chi; see unbias().
template <class T>
struct FilterBias {
  T variance_t{};   ///< of the noise that is still in x and y, by chi^2 [m^2]
  T variance_xy{};  ///< with that of the rotation, in x and y [-]
  T mean{};         ///< error of chi [1/m] that the declared noise would cause
  T levelSum = T{} + kFirstLevel * kLevelWeight;  ///< / levelWeight: true / declared variance
  T levelWeight = T{} + kLevelWeight;
};

template <class T>
struct FilterState {
  T x, y, c;
  T xx, xy, xc, yy, yc, cc;
  FilterBias<T> bias{};
};

/// Derivative of the flow: row x, row y, row chi.
template <class T>
struct FlowDerivative {
  T xx, xy, xc, yx, yy, yc, cx, cy, cc;
};

template <class T>
struct Prediction {
  FilterState<T> state;
  FlowDerivative<T> F;
  T q3;    ///< > 0: ahead of the camera
  T size;  ///< squares of the state and variances: large or NaN when anything has overflowed
};

template <class T>
DEPTHSERVO_INLINE void predictState(const FilterStep& m, const FilterState<T>& s,
                                    Prediction<T>& next) {
  const T q1 = m.R11 * s.x + m.R12 * s.y + m.R13 + m.t1 * s.c;
  const T q2 = m.R21 * s.x + m.R22 * s.y + m.R23 + m.t2 * s.c;
  const T q3 = m.R31 * s.x + m.R32 * s.y + m.R33 + m.t3 * s.c;
  const T scale = 1 / q3;
  const T x = q1 * scale, y = q2 * scale, c = s.c * scale;
  next.q3 = q3;
  FlowDerivative<T>& F = next.F;
  F.xx = (m.R11 - x * m.R31) * scale;
  F.xy = (m.R12 - x * m.R32) * scale;
  F.xc = (m.t1 - x * m.t3) * scale;
  F.yx = (m.R21 - y * m.R31) * scale;
  F.yy = (m.R22 - y * m.R32) * scale;
  F.yc = (m.t2 - y * m.t3) * scale;
  F.cx = -c * m.R31 * scale;
  F.cy = -c * m.R32 * scale;
  F.cc = (1 - c * m.t3) * scale;

  // A = F P with the parallax entries of F scaled by rho.
  const T xcRho = m.rho * F.xc, ycRho = m.rho * F.yc;
  const T Axx = F.xx * s.xx + F.xy * s.xy + xcRho * s.xc;
  const T Axy = F.xx * s.xy + F.xy * s.yy + xcRho * s.yc;
  const T Axc = F.xx * s.xc + F.xy * s.yc + xcRho * s.cc;
  const T Ayx = F.yx * s.xx + F.yy * s.xy + ycRho * s.xc;
  const T Ayy = F.yx * s.xy + F.yy * s.yy + ycRho * s.yc;
  const T Ayc = F.yx * s.xc + F.yy * s.yc + ycRho * s.cc;
  const T Acx = F.cx * s.xx + F.cy * s.xy + F.cc * s.xc;
  const T Acy = F.cx * s.xy + F.cy * s.yy + F.cc * s.yc;
  const T Acc = F.cx * s.xc + F.cy * s.yc + F.cc * s.cc;

  // Q = L W L' in closed form.
  const T x2 = x * x, y2 = y * y, xy = x * y;
  const T k = m.variance_t * (c * c);
  const double q = m.variance_theta;
  const T across = k + q * (1 + x2 + y2);  // of k xy + q xy (1 + x^2 + y^2) and the like
  const T x1 = 1 + x2, y1 = 1 + y2;
  FilterState<T>& n = next.state;
  n.x = x;
  n.y = y;
  n.c = c;
  n.xx = Axx * F.xx + Axy * F.xy + Axc * xcRho + k * x1 + q * (x2 * y2 + x1 * x1 + y2);
  n.xy = Axx * F.yx + Axy * F.yy + Axc * ycRho + across * xy;
  n.xc = Axx * F.cx + Axy * F.cy + Axc * F.cc + across * (c * x);
  n.yy = Ayx * F.yx + Ayy * F.yy + Ayc * ycRho + k * y1 + q * (y1 * y1 + x2 * y2 + x2);
  n.yc = Ayx * F.cx + Ayy * F.cy + Ayc * F.cc + across * (c * y);
  n.cc = Acx * F.cx + Acy * F.cy + Acc * F.cc + c * c * (k + q * (x2 + y2));
  n.bias = s.bias;
  n.bias.variance_t = n.bias.variance_t + m.bias_variance;
  n.bias.variance_xy = n.bias.variance_xy + k + q;
  n.bias.mean = n.bias.mean * F.cc;
  next.size = x2 + y2 + c * c + n.xx + n.yy + n.cc;
}

template <class T>
struct FilterInnovation {
  T x, y;  ///< measured - predicted
  T det;   ///< of its covariance
  T nis;   ///< normalised innovation squared
};

template <class T>
DEPTHSERVO_INLINE void innovate(const FilterState<T>& s, const T& x, const T& y, const T& r,
                                FilterInnovation<T>& nu) {
  const T a = s.xx + r, c = s.yy + r;
  nu.x = x - s.x;
  nu.y = y - s.y;
  nu.det = a * c - s.xy * s.xy;
  nu.nis = (c * nu.x * nu.x - 2 * s.xy * (nu.x * nu.y) + a * nu.y * nu.y) / nu.det;
}

/// Kalman gain: d(x, y, chi) by the innovation's x and y.
template <class T>
struct FilterGain {
  T xx, xy, yx, yy, cx, cy;
};

/// Share of chi^2 in E; 4 by the first order, the rest for the higher ones.
constexpr double kBiasOfNoise = 4.4;

/// True noise is taken to have at most this many times the declared variance.
constexpr double kLargestLevel = 2;

/// Innovations beyond the gate, believed after many, count no more than this.
constexpr double kLargestNis = 14;

/// No step is taken to be more biased than this.
constexpr double kLargestBias = 0.2;

/// Keeps quotients of two zeros zero.
constexpr double kNothing = 1e-300;

/// Takes the bias of measured translation noise back, as far as the noise is there.
///
/// Such noise e is in the innovation, - chi e, and through F in the gain of chi, too (errors in
/// variables). With D = P_xc / P_cc, the parallax since x was last measured, S the innovation's
/// variance and V that of the noise in D, both along one axis, the mean of gain times innovation is
///     - chi E,   E = V d/dD [D / (D^2 + S / P_cc)], over both axes  = 2 V P_cc+ / S,
/// and D^2 is too large, so that P_cc+ has to be 1 + E times itself. How much noise there is, is in the
/// innovations: their NIS is 2 + h (level - 1), where h = 2 (share of odometry noise in S) and level
/// the true variance in units of the declared. chi is corrected by level E chi, as far as it is
/// known; E chi, with what chi may be more than it seems, sums up to `bias.mean`, of which a share
/// enters sigma (biasVariance).
template <class T>
DEPTHSERVO_INLINE void unbias(FilterState<T>& s, const T& before, const T& twiceS, const T& nis,
                              const FilterGain<T>& K) {
  FilterBias<T>& b = s.bias;
  const T share = kBiasOfNoise / twiceS, h = share * b.variance_xy;
  const T bounded = nis < kLargestNis ? nis : kLargestNis + 0 * nis;
  b.levelSum = b.levelSum + h * (bounded - 2 + h);
  b.levelWeight = b.levelWeight + h * h;
  T level = b.levelSum / b.levelWeight;
  level = level > 0 ? level : 0 * level;
  level = level < kLargestLevel ? level : kLargestLevel + 0 * level;
  T E = share * b.variance_t * s.cc;
  E = E < kLargestBias ? E : kLargestBias + 0 * E;
  const T c2 = s.c * s.c, size = 1 / (c2 + 0.25 * before + kNothing), known = E * (c2 * size);
  const T chi = s.c > 0 ? s.c : -s.c;
  b.mean = b.mean * (s.cc / (before + kNothing)) + E * chi * (1 + 2 * s.cc * size);
  s.c = s.c + level * known * s.c;
  s.cc = s.cc * (1 + known);
  const T kept = (1 - K.xx) * (1 - K.yy);
  b.variance_t = b.variance_t * kept;
  b.variance_xy = b.variance_xy * kept;
}

/// With measurement variance r I the corrected covariance is r K in all but chi: nothing cancels.
template <class T>
DEPTHSERVO_INLINE void correctState(FilterState<T>& s, const FilterInnovation<T>& nu, const T& r,
                                    FilterGain<T>& K) {
  const T a = s.xx + r, b = s.xy, c = s.yy + r;
  const T scale = 1 / (a * c - b * b);
  const T ax = a * scale, bx = b * scale, cx = c * scale;
  K.xx = s.xx * cx - s.xy * bx;
  K.xy = s.xy * ax - s.xx * bx;
  K.yx = s.xy * cx - s.yy * bx;
  K.yy = s.yy * ax - s.xy * bx;
  K.cx = s.xc * cx - s.yc * bx;
  K.cy = s.yc * ax - s.xc * bx;
  s.x = s.x + K.xx * nu.x + K.xy * nu.y;
  s.y = s.y + K.yx * nu.x + K.yy * nu.y;
  s.c = s.c + K.cx * nu.x + K.cy * nu.y;
  const T before = s.cc, left = before - (K.cx * s.xc + K.cy * s.yc), least = kLeastShare * before;
  s.cc = left > least ? left : least;
  s.xx = r * K.xx;
  s.xy = r * 0.5 * (K.xy + K.yx);
  s.xc = r * K.cx;
  s.yy = r * K.yy;
  s.yc = r * K.cy;
  unbias(s, before, a + c, nu.nis, K);
}

}  // namespace depthservo::detail
