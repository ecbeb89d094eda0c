#pragma once

#include <algorithm>

#include "depthservo/motion/Motion.h"

namespace depthservo {

/// Where the twists of the odometry come from.
enum class OdometryMode {
  /// Read from sensors: the noise is in the twist the estimator gets. A camera at rest then seems
  /// to move, and depth must not be learnt from that; see OdometryNoise::deadBand.
  measured,
  /// The command itself: the noise is in what the camera really does. At rest the twist is exactly
  /// zero.
  commanded
};

/// White noise of the odometry, per row and axis (1 sigma). A row's noise is the greater of the
/// floor and the share of its speed.
struct OdometryNoise {
  double sigma_v = 0.002;    ///< floor for linear velocity [m/s]; 0: exact
  double sigma_w = 0.001;    ///< floor for angular velocity [rad/s]; 0: exact
  double relative_v = 0.01;  ///< share of the linear speed [-]
  double relative_w = 0.01;  ///< share of the angular speed [-]
  OdometryMode mode = OdometryMode::measured;

  /// Measured speeds below this many sigma_v are taken for noise and tell nothing of depth. Without
  /// it a camera at rest would drive chi to zero with a small sigma (errors in variables); with
  /// less than 5 some of that remains.
  double deadBand = 5;

  /// Odometry without any error.
  static OdometryNoise none() { return {0, 0, 0, 0, OdometryMode::commanded}; }

  /// White noise of the same size at any speed.
  static OdometryNoise white(double sigma_v, double sigma_w,
                             OdometryMode mode = OdometryMode::measured) {
    return {sigma_v, sigma_w, 0, 0, mode};
  }

  /// What a motion inherits from its rows.
  struct Step {
    double variance_t = 0;      ///< of each component of its translation [m^2]
    double variance_theta = 0;  ///< of each component of its rotation [rad^2]
    double rho = 1;  ///< share of its parallax that is motion, not noise: 0 in the dead band .. 1
    double bias_variance = 0;  ///< of each component of its translation, as far as it teaches, when
                               ///< the estimator gets it too: it then biases depth [m^2]
    bool isKnown = true;       ///< the whole motion is
  };

  /// For a finite motion with dt > 0. Rows that last h_i give it the variance sigma^2 sum h_i^2.
  Step over(const Motion& motion) const {
    const double dt2 = motion.dt2 > 0 ? motion.dt2 : motion.dt * motion.dt;
    const double perRow = dt2 / (motion.dt * motion.dt);
    const double t2 = motion.t.squaredNorm();
    Step step;
    step.isKnown = !motion.unknown.exists();
    step.variance_t = std::max(sigma_v * sigma_v * dt2, relative_v * relative_v * t2 * perRow);
    step.variance_theta = sigma_w * sigma_w * dt2;
    if (relative_w > 0) {
      const Eigen::Matrix3d& R = motion.R;
      const double a = R(2, 1) - R(1, 2), b = R(0, 2) - R(2, 0), c = R(1, 0) - R(0, 1);
      const double theta2 = 0.25 * (a * a + b * b + c * c);  // sin^2 of the angle
      step.variance_theta =
          std::max(step.variance_theta, relative_w * relative_w * theta2 * perRow);
    }
    if (mode == OdometryMode::measured && step.variance_t > 0) {
      step.rho = t2 > 0 ? std::clamp(1 - deadBand * deadBand * step.variance_t / t2, 0., 1.) : 0.;
      step.bias_variance = step.rho * step.variance_t;
    }
    // What the truth varies by around the rows biases nothing: it is not in what they say.
    step.variance_t += motion.within.t2;
    step.variance_theta += motion.within.theta2;
    return step;
  }
};

}  // namespace depthservo
