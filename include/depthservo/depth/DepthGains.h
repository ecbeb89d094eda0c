#pragma once

#include <limits>
#include <string>

#include "depthservo/api.h"
#include "depthservo/depth/NonlinearDepthObserver.h"

namespace depthservo {

/// Excitation [m/s] at which gains are judged when nothing better is known.
constexpr double kGainExcitation = 0.1;

/// Fixed gains of the depth observer at a frame rate, and what they do at an excitation: De Luca,
/// Oriolo, Robuffo Giordano 2008, with
///     wn = sqrt(k_3) W,   zeta = k/(2 wn),   settled to 2 % after 5.83/wn for zeta = 1,
///     std(chi) = sigma sqrt(dt) k_3 W / sqrt(2 k),   std(Z) = Z^2 std(chi).
/// How an observer is sampled decides up to what excitation it is stable (n = k dt,
/// m = k_3 W^2 dt^2): Euler's method for m < n and 2n - m < 4, exact flow with Euler's correction
/// for 2n + m < 4, exact flow with matched poles, which is NonlinearDepthObserver, for any.
struct DEPTHSERVO_API DepthGains {
  double k = 0;           ///< k_1 = k_2 [1/s]
  double k_3 = 0;         ///< normalised [1/m^2]; in pixels: k_3 / focal_px^2
  double excitation = 0;  ///< W [m/s], root mean square
  double fps = 0;         ///< [Hz]

  /// Critically damped, settled to 2 % in this time [s] at this excitation.
  /// Throws std::invalid_argument for what is not > 0 and finite, or too fast for the frame rate.
  static DepthGains design(double settling_s, double excitation, double fps);

  /// Gains as given. Throws std::invalid_argument for what is not > 0 and finite, and for gains
  /// with wn dt > 1, which are in the wrong unit.
  static DepthGains given(double k, double k_3, double excitation, double fps);

  double wn() const;          ///< natural frequency [rad/s]
  double damping() const;     ///< zeta [-]
  double settling_s() const;  ///< to 2 % of the slower pole, or of the envelope [s]

  /// 1 sigma of an observed depth Z [m] under this noise of the image (1 sigma per axis) [px].
  double sigma_Z(double Z, double noise_px, double focal_px) const;

  double k_3_px(double focal_px) const { return k_3 / (focal_px * focal_px); }

  /// Excitations W [m/s] between which a discretisation is stable at this frame rate. Empty when
  /// low >= high.
  struct Stability {
    double low = 0, high = std::numeric_limits<double>::infinity();

    /// How many times the excitation may grow; below 1: unstable.
    double margin(double excitation) const;
  };
  Stability euler() const;                       ///< the differential equation by Euler's method
  Stability flowEuler() const;                   ///< exact flow, gains k dt and k_3 dt
  static Stability poleMatched() { return {}; }  ///< exact flow, matched poles

  /// Why gains are implausible (wrong unit): wn dt > 1 at this excitation, in one sentence; empty
  /// when they are not.
  static std::string objection(double k_3, double excitation, double fps);
};

}  // namespace depthservo
