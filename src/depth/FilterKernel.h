#pragma once

#include "depthservo/motion/OdometryNoise.h"

/// The arithmetic of InverseDepthFilter, for T = double or a vector of doubles: no branches, one
/// place. Names: c is chi; `xy` of a covariance is that of x and y.
namespace depthservo::detail {

#define DEPTHSERVO_INLINE __attribute__((always_inline)) inline

/// A camera motion as the kernel reads it.
struct FilterStep {
  double R11, R12, R13, R21, R22, R23, R31, R32, R33, t1, t2, t3;
  double variance_t, variance_theta, rho, pull;

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
        pull(noise.pull) {}
};

/// No update can be trusted to leave less of a variance than this share: rounding.
constexpr double kLeastShare = 1e-15;

template <class T>
struct FilterState {
  T x, y, c;
  T xx, xy, xc, yy, yc, cc;
  T pull{};  ///< OdometryNoise::Step::pull since the last correction
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
  n.pull = s.pull + m.pull;
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

/// Relative sigma of chi, squared, below which the pull of measured noise is taken back: further
/// out its mean, a derivative by chi, is not to be trusted.
constexpr double kLargestPulled = 0.04;

/// With measurement variance r I the corrected covariance is r K in all but chi: nothing cancels.
///
/// Measured translation noise e is in the innovation, - chi e, and through F in the gain of chi,
/// too: with their product's mean, first order in the noise's variance `pull`, chi would be pulled
/// to zero. What is added is that mean with the opposite sign, for K_c(F) = F P / (F^2 P + r).
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
  const T removed = K.cx * s.xc + K.cy * s.yc, half = s.cc - 2 * removed;
  const T slope = (half > 0) & (s.cc < kLargestPulled * (s.c * s.c)) ? half : s.cc * 0;
  const T across = (1 + s.x * s.x) * cx + (1 + s.y * s.y) * ax;
  s.c = s.c + K.cx * nu.x + K.cy * nu.y + s.pull * s.c * slope * across;
  s.pull = s.cc * 0;
  const T cc = s.cc - removed, least = kLeastShare * s.cc;
  s.cc = cc > least ? cc : least;
  s.xx = r * K.xx;
  s.xy = r * 0.5 * (K.xy + K.yx);
  s.xc = r * K.cx;
  s.yy = r * K.yy;
  s.yc = r * K.cy;
}

}  // namespace depthservo::detail
