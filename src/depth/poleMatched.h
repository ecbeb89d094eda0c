#pragma once

#include <cmath>

namespace depthservo {

/// (1 - p1)(1 - p2) with p_i = exp(s_i Dt), s_i the roots of s^2 + k s + wn2 = 0: how much of an
/// unknown that drives a measured error a correction takes back after Dt [s], so that the sampled
/// error has exactly the poles of the continuous one. Stable for any k > 0, wn2 >= 0, Dt > 0.
/// \rtsafe
inline double poleMatchedGain(double k, double wn2, double Dt) {
  const double half = 0.5 * k;
  const double D = half * half - wn2;
  if (D >= 0) {  // written so that nothing cancels when wn2 is small
    const double fast = half + std::sqrt(D);
    const double slow = wn2 / fast;
    return std::expm1(-fast * Dt) * std::expm1(-slow * Dt);
  }
  const double oneMinus = -std::expm1(-half * Dt);
  const double s = std::sin(0.5 * std::sqrt(-D) * Dt);
  return oneMinus * oneMinus + 4 * (1 - oneMinus) * s * s;
}

}  // namespace depthservo
