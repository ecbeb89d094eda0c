#pragma once

#include <Eigen/Core>

#include "depthservo/api.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo {

/// First-order Gauss-Markov process: an error that lasts for a while.
struct GaussMarkov {
  double sigma = 0;  ///< 1 sigma, in the unit of what errs; 0: none
  double tau_s = 0;  ///< correlation time [s]; 0: white, anew in each image

  /// Correlation over this time [-].
  double kept(double dt) const { return tau_s > 0 ? std::exp(-dt / tau_s) : 0; }

  /// How many times its variance counts where it is taken for white noise of images dt apart, so
  /// that what many images tell is right.
  double asWhite(double dt) const {
    const double rho = kept(dt);
    return (1 + rho) / (1 - rho);
  }
};

/// How large the errors of a robot may be, 1 sigma each; 0: none. Most of them are constant or
/// last, which white noise does not describe: with it a filter claims far too much.
struct DEPTHSERVO_API ErrorProfile {
  /// Relative error S of the translation (wheel radius, units): true = (1 + S) measured. Constant.
  /// No image can tell it: depths scale with it, and their sigma contains it.
  double scale = 0;
  GaussMarkov slip;  ///< likewise, but for a while

  double gyroBias_rad_s = 0;  ///< constant, per axis of the camera: measured = true + bias
  /// White noise of the rows; only `sigma_v`, `sigma_w`, `relative_v` and `relative_w` are used.
  OdometryNoise odometry = OdometryNoise::white(0, 0);

  double latency_s = 0;  ///< constant: an image's stamp is later than its exposure by this
  double jitter_s = 0;   ///< of stamps, white, common to all points of an image
  double readout_s = 0;  ///< rolling shutter: how much later than the first row the last is exposed

  double focal = 0;  ///< relative error of the focal length. Constant
  double mount_rad =
      0;  ///< rotation of the camera against where it is said to be mounted, per axis
  GaussMarkov wander_px;  ///< of each point's tracker, per axis, besides its white noise

  /// Poses from which the motion is taken, or which it sums up to: their error in the camera frame,
  /// per axis.
  double position_m = 0, angle_rad = 0, poseTau_s = 0;

  /// What the constants are, by calibration; the sizes above are then those of their errors. A
  /// sigma of an axis that is not above 0 is the size above.
  struct Values {
    double scale = 0, latency_s = 0, focal = 0;
    Eigen::Vector3d gyroBias_rad_s = Eigen::Vector3d::Zero(), mount_rad = Eigen::Vector3d::Zero();
    Eigen::Vector3d gyroBiasSigma_rad_s = Eigen::Vector3d::Zero(),
                    mountSigma_rad = Eigen::Vector3d::Zero();
  } values;

  double gyroBiasSigma(int axis) const {
    return sigmaOf(values.gyroBiasSigma_rad_s, axis, gyroBias_rad_s);
  }
  double mountSigma(int axis) const { return sigmaOf(values.mountSigma_rad, axis, mount_rad); }

  /// A wheeled robot with a gyro, calibrated as well as one usually does.
  static ErrorProfile typical();
  /// An arm: precise joints, a camera mounted by hand.
  static ErrorProfile arm();
  /// Motion from poses: motion capture, visual SLAM, an arm's forward kinematics.
  static ErrorProfile poses();

 private:
  static double sigmaOf(const Eigen::Vector3d& own, int axis, double common) {
    return own(axis) > 0 ? own(axis) : common;
  }
};

}  // namespace depthservo
