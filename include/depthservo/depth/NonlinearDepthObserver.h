#pragma once

#include <algorithm>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/ObserverStep.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo {

/// Gains of the nonlinear observer, always for normalised image coordinates:
/// `k_3 (normalised) = focal_px^2 * k_3 (pixels)`, k_1 = k_2 = k in 1/s either way.
///
/// With excitation W [m/s] the depth error obeys s^2 + k s + k_3 W^2 = 0: natural frequency
/// wn = sqrt(k_3) W, damping k/(2 wn), settled to 2 % after 5.83/wn when critically damped.
struct DEPTHSERVO_API ObserverGains {
  double k = 0;      ///< k_1 = k_2 [1/s], > 0
  double k_3 = 0;    ///< [1/m^2], >= 0; used when W_min is 0
  double W_min = 0;  ///< [m/s]; > 0 schedules k_3 = wn^2 / max(W^2, W_min^2)
  double wn = 0;     ///< [rad/s]; with scheduling, the natural frequency to keep

  /// Critically damped, settled to 2 % in `settling_s` at an excitation of `W0` [m/s].
  static ObserverGains fromSettlingTime(double settling_s, double W0);

  /// The same settling time at any excitation above W_min [m/s], below which noise would be
  /// amplified.
  static ObserverGains scheduled(double settling_s, double W_min);

  /// k_3 W^2, the squared natural frequency [1/s^2], at the squared excitation W^2 [m^2/s^2].
  double wn2At(double W2) const {
    return W_min > 0 ? wn * wn * std::min(1.0, W2 / (W_min * W_min)) : k_3 * W2;
  }
};

/// When the observer speaks of excitation, doubts a measurement or gives a point up.
struct NonlinearObserverOptions {
  ObserverGains gains = ObserverGains::scheduled(1.5, 0.01);

  /// Window of the excitation measure J [s]: dJ/dt = W^2 - J / window.
  double window_s = 1;

  /// A measurement is rejected when it is farther from the prediction than `gate_sigma` standard
  /// deviations and than `gate` (normalised); after `rejectionsInARow` it is believed all the same.
  double gate_sigma = 6;
  double gate = 0.02;
  int rejectionsInARow = 5;

  /// Widens sigma; and depth is not corrected from motions in the noise's dead band, since measured
  /// noise alone would pull it to infinity. Default: exact odometry.
  OdometryNoise odometry = OdometryNoise::none();

  /// The point is lost when it is predicted less precisely than this (1 sigma, normalised).
  double lost_sigma = 0.1;
};

/// Nonlinear observer of (x, y, chi) by De Luca, Oriolo and Robuffo Giordano, "Feature Depth
/// Observation for Image-based Visual Servoing", IJRR 27(10), 2008, eq. 11-14, sampled without
/// integration error:
///
///   predict   (x, y, chi) <- flow of the camera's motion (exact at any frame rate)
///   correct   nu = measured (x, y) - predicted,   b = d(x, y)/dchi over the time Dt since the last
///   correction
///             (x, y) += (1 - p1 p2) nu
///             chi    += (1 - p1)(1 - p2) (b.nu)/(b.b),   p_i = exp(s_i Dt)
///
/// where s_i are the roots of s^2 + k s + k_3 W^2, W = |b|/Dt: the poles of the continuous
/// observer, matched exactly, hence stable at any frame rate and gain. b is what the paper's Omega
/// chi becomes over Dt.
///
/// Depth is learnt only while the camera translates across the line of sight (W > 0). The windowed
/// measure J of W^2 tells: while k_3 J / k < 1, or without translation, the status is `unexcited`.
///
/// A point that passed behind the camera stays `lost` until it is measured again, and then starts
/// anew with the depth it had.
///
/// sigma_chi is approximate: the variance of the linear error dynamics above (image noise as given
/// with each measurement, prior as given), without the coupling between the two image axes. It has
/// no share for odometry errors, which scale Z: a translation 2 % too long gives Z 2 % too large.
class DEPTHSERVO_API NonlinearDepthObserver : public DepthEstimator {
 public:
  using Options = NonlinearObserverOptions;

  explicit NonlinearDepthObserver(const Options& options = {}, const DepthRange& range = {});

  std::unique_ptr<DepthEstimator> clone() const override;
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override;
  void predict(const Motion& motion) override;
  void correct(const PointMeasurement& measurement) override;
  void correctDepth(const DepthPrior& measured) override;
  DepthEstimate estimate() const override;

  /// Windowed excitation J [m^2/s], see window_s.
  double windowedExcitation() const { return window_.J(); }

 private:
  using Phase = detail::ObserverPhase;

  detail::LineVariance predictedVariance() const;
  bool isExcited() const;
  void letDrift(const UnknownPart& unknown);

  Options options_;
  DepthRange range_;
  PointState point_;
  Phase phase_ = Phase::unset;
  detail::LineVariance variance_;   // at the last correction
  detail::LineVariance predicted_;  // now
  detail::PoleMatchedGains gains_;

  // Since the last correction: time, and derivative of the composed flow by chi.
  double elapsed_s_ = 0;
  Eigen::Vector3d J_point_chi_ = Eigen::Vector3d::UnitZ();
  double rho_ = 1;               // share that is not noise: the least of its motions
  double odometryVariance_ = 0;  // of one image axis

  double W_ = 0;  // excitation over the last motion [m/s]
  detail::ExcitationWindow window_;
  int rejections_ = 0;         // in a row
  bool isAdrift_ = false;      // the motion since the last measurement is not known
  bool isMotionKnown_ = true;  // of the last motion
};

}  // namespace depthservo
