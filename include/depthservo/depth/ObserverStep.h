#pragma once

#include <algorithm>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"

namespace depthservo::detail {

/// What became of an observed point. `vague`: predicted for too long; `gone`: behind the camera, or
/// numerically invalid, it starts anew with its next measurement.
enum class ObserverPhase { unset, measured, coasting, vague, rejected, gone };

/// \param isExcited, isFound of what is being observed
inline DepthStatus statusOf(ObserverPhase phase, bool isExcited, bool isFound) {
  switch (phase) {
    case ObserverPhase::unset:
      return DepthStatus::unset;
    case ObserverPhase::vague:
    case ObserverPhase::gone:
      return DepthStatus::lost;
    case ObserverPhase::coasting:
      return DepthStatus::coasting;
    case ObserverPhase::rejected:
      return DepthStatus::rejected;
    case ObserverPhase::measured:
      break;
  }
  if (!isExcited) return DepthStatus::unexcited;
  return isFound ? DepthStatus::valid : DepthStatus::converging;
}

/// wn times the settling time to 2 % of s^2 + 2 wn s + wn^2.
constexpr double kSettling = 5.83;

/// What the discrete poles p_i = exp(s_i Dt), s^2 + k s + wn^2 = 0, ask of the gains of a nonlinear
/// observer. Made anew only when Dt or wn^2 change: at a steady frame rate the exponentials, which
/// cost most, stay.
struct DEPTHSERVO_API PoleMatchedGains {
  double Dt = 0, wn2 = 0;
  double point = 0;  ///< 1 - p1 p2
  double chi = 0;    ///< (1 - p1)(1 - p2)

  void match(double k, double squaredFrequency, double duration_s);
};

/// Running mean of the excitation, with forgetting.
class DEPTHSERVO_API ExcitationWindow {
 public:
  /// \param W2 squared excitation over the last dt [m^2/s^2]
  /// \param decayRate of the depth error in it [1/s]
  void add(double W2, double decayRate, double dt, double window_s);

  double J() const { return J_; }  ///< dJ/dt = W^2 - J / window [m^2/s]

  /// Whether the depth error decays by 1/e or more over the window, or over what of it was seen.
  bool isExcited() const { return filled_ > 0 && decay_ >= filled_; }

 private:
  double dt_ = 0, share_ = 0;  // of the window that dt takes up; kept while dt stays
  double J_ = 0;
  double filled_ = 0;  // fraction of the window seen so far, 0..1
  double decay_ = 0;   // decay exponent of the depth error
};

/// Error variances along the line b on the image (l) and of chi (c).
struct LineVariance {
  double ll = 0, lc = 0, cc = 0;

  /// After a motion over which the point moves by B per chi, and chi by g per chi.
  LineVariance predicted(double B, double g, double noise) const {
    return {ll + B * (2 * lc + B * cc) + noise, g * (lc + B * cc), g * g * cc};
  }

  /// This prediction, after a correction with these gains on the innovation along the line, whose
  /// measurement noise is r.
  LineVariance corrected(double pointGain, double chiGain, double r) const {
    const double keep = 1 - pointGain;
    return {keep * keep * ll + pointGain * pointGain * r,
            keep * (lc - chiGain * ll) + pointGain * chiGain * r,
            cc - 2 * chiGain * lc + chiGain * chiGain * (ll + r)};
  }
};

/// Excitation [m/s] below which the camera does not translate across the line of sight at all.
constexpr double kNoExcitation = 1e-9;

/// Speeds [m/s] and derivatives of the flow beyond which a motion is nonsense: squares stay finite.
constexpr double kBeyondSense = 1e9;

/// No camera sees a point farther from its prediction than this (84 degrees off its axis).
constexpr double kLargestInnovation = 10;

constexpr double square(double a) { return a * a; }

/// Square of the distance from the prediction [-] above which a measurement is rejected.
/// \param gate, gate_sigma of the observer's options \param variance of the innovation
inline double squaredGate(double gate, double gate_sigma, double variance) {
  return std::min(std::max(square(gate), square(gate_sigma) * variance),
                  square(kLargestInnovation));
}

}  // namespace depthservo::detail
