#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo {

/// What the present motion, kept up, will tell of a depth: the rule of thumb for motion across the
/// line of sight with speed W over k frames (least squares line through k image positions),
///     sigma_chi^2 = 12 (sigma / (W dt))^2 / k^3 + (sigma_t^2 chi^2 + sigma_theta^2) / (W dt)^2 /
///     k,
/// image noise first, then white odometry noise.
struct DEPTHSERVO_API DepthForecast {
  double parallax = 0;        ///< W dt: translation across the line of sight in a frame [m]
  double sigma = 0;           ///< of a measurement, normalised [-]
  double variance_t = 0;      ///< of the translation in a frame [m^2]
  double variance_theta = 0;  ///< of the rotation in a frame [rad^2]

  /// If the camera goes on as in its last motion.
  /// \param sigma of a measurement, normalised [-]
  static DepthForecast of(const DepthEstimate& estimate, double sigma, const Motion& motion,
                          const OdometryNoise& odometry);

  /// Variance of the inverse depth `chi` [1/m^2] from `frames` more frames alone; infinite without
  /// parallax.
  double variance(double chi, double frames) const;

  /// sigma_chi [1/m] after `frames` more frames, now being `sigma_chi`.
  double sigma_chiAfter(double chi, double sigma_chi, double frames) const;

  /// Whether `frames` more frames make sigma_chi, whose square is now `variance_chi`, smaller by
  /// more than this share of it; `sigma_chiAfter` without roots and divisions.
  bool tells(double share, double chi, double variance_chi, double frames) const {
    const double needed = 1 / ((1 - share) * (1 - share)) - 1;
    const double n2 = frames * frames;
    const double unknown = 12 * sigma * sigma + (variance_t * chi * chi + variance_theta) * n2;
    return variance_chi * parallax * parallax * n2 * frames > needed * unknown;
  }

  /// Frames until sigma_chi falls below `relative` of chi, now being `sigma_chi`; 0 when it is
  /// already, infinite without parallax or when chi is not positive. With 0.05: frames to 5 %.
  double framesTo(double relative, double chi, double sigma_chi) const;
};

}  // namespace depthservo
