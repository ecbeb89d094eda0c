#pragma once

#include <Eigen/Core>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/motion/Flow.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo {

/// The limit for every estimator that is given the same images and odometry: posterior Cramer-Rao
/// bound (Tichavsky, Muravchik, Nehorai, IEEE Trans. Signal Processing 46(5), 1998) of still points
/// that share the odometry's error, along their true path:
///
///   advance  P <- F P F' + Q,  Q = L W L' over all points (rank 6)
///   measure  P^-1 <- P^-1 + diag(1/r, 1/r, 0) for the measured point
///
/// With one point it is the bound for estimators that treat each point alone, with several that of
/// joint ones. P is the bound itself, over (x, y, chi) of each point; it begins so wide that
/// nothing is known. The lasting errors of a profile (see SharedErrorFilter for the equations) are
/// further states: latency, gyro bias, mount, focal length, scale, slip, the error of the image's
/// pose, jitter, and two of wander for each point. All are linearised at the truth, where they are
/// zero. Allocates; for evaluation, not the loop.
class DEPTHSERVO_API CramerRaoBound {
 public:
  /// \param points true (x, y, chi) in the first image, in which nothing is measured yet
  /// \param sigma_chi prior knowledge of each chi [1/m]; infinite: none
  /// \param errors what lasts of the robot's errors; its white noise is given to `advance`
  /// \param focal_px turns the profile's pixels into normalised coordinates [px]
  CramerRaoBound(std::vector<PointState> points, double sigma_chi, const ErrorProfile& errors = {},
                 double focal_px = 600);

  /// Follows the camera's true motion. A point that passes behind the camera is given up: its bound
  /// is infinite from then on.
  void advance(const Motion& motion, const OdometryNoise& odometry);

  /// Counts a measurement of point i with this standard deviation (normalised, > 0).
  void measure(std::size_t i, double sigma);

  /// Least sigma_chi [1/m] any unbiased estimator can have of point i.
  double sigma_chi(std::size_t i) const;

  /// The same relative to chi: least sigma_Z / Z.
  double relativeSigma(std::size_t i) const { return sigma_chi(i) / points_[i].chi; }

  const PointState& point(std::size_t i) const { return points_[i]; }

 private:
  void renew(Eigen::Index first, Eigen::Index count, double sigma, double kept);

  std::vector<PointState> points_;
  std::vector<bool> ahead_;
  ErrorProfile errors_;
  double wander_;            // normalised
  Eigen::Index shared_ = 0;  // first row of the shared states; those of wander follow them
  Eigen::Index wanders_ = 0;
  bool hasTwist_ = false;
  Twist twist_;  // of the last motion
  Eigen::MatrixXd P_;
};

}  // namespace depthservo
