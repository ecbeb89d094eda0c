#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo {

/// Defaults suit most cases; what to set first is the odometry's noise and mode, or a profile of
/// the robot by `considering`.
struct DEPTHSERVO_API InverseDepthFilterOptions {
  OdometryNoise odometry;

  /// Relative uncertainty of the translation's scale (wheel radius, calibration), 1 sigma [-]. Z
  /// scales with it and no image can tell, so it is not estimated but enters the reported sigma.
  double odometryScaleSigma = 0;

  /// Relative uncertainty of the focal length, 1 sigma [-]; likewise.
  double focalSigma = 0;

  /// Errors that last, or are not those of the odometry's rows: latency, gyro bias and mount are
  /// considered likewise, slip, jitter, wander and pose noise enter as the white noise that tells
  /// as much. Its scale, focal length and white noise are not used: they are the three options
  /// above. InverseDepthFilter alone reads it, not the filters of many points.
  ErrorProfile lasting;
  double focal_px = 600;  ///< turns the wander's pixels into normalised coordinates [px]

  /// The options for a robot with such errors.
  static InverseDepthFilterOptions considering(const ErrorProfile& errors, double focal_px);

  /// A measurement is rejected when its normalised innovation squared (NIS, chi-square with 2
  /// degrees of freedom) is above this: 13.8 refuses 0.1 % of good ones.
  double gate = 13.8;

  /// After so many rejections in a row measurements are believed again, with little weight; after
  /// twice as many the point starts anew there (a point that has just started, after two).
  int rejectionsInARow = 5;

  /// Innovations beyond this many sigma lose weight (Huber).
  double huber = 2.5;

  /// The point is lost when it is predicted less precisely than this (1 sigma, normalised).
  double lost_sigma = 0.1;
};

namespace detail {

/// One point of the filter: state, covariance, and what the last step says of it.
struct FilterPoint {
  // adrift: the motion since the last measurement is not known
  enum class Phase : unsigned char { unset, measured, coasting, adrift, rejected, behind };

  double x = 0, y = 0, chi = 1;                           // chi is not bounded
  double xx = 0, xy = 0, xc = 0, yy = 0, yc = 0, cc = 0;  // covariance, c is chi
  double noise_t = 0, noise_xy = 0, bias = 0, levelSum = 2, levelWeight = 4;  // FilterBias
  double scale[3] = {0, 0, 0}, focal[3] = {0, 0, 0};  // d(error of x, y, chi) by either
  double parallax2 = 0;                               // of the last motion [m^2]
  double r = 0;                                       // variance of the last measurement
  int rejections = 0;                                 // in a row
  unsigned char accepted = 0;                         // since the start, up to 5
  Phase phase = Phase::unset;
};

/// What lasting errors do to the error of one point: d(error of x, y, chi) by the latency, the
/// gyro's bias and the rotation of the mount.
struct DEPTHSERVO_API LastingErrors {
  using Row = Eigen::Matrix<double, 1, 7>;
  static constexpr int kLatency = 0, kBias = 1, kMount = 4;  // first columns

  Eigen::Matrix<double, 3, 7> A = Eigen::Matrix<double, 3, 7>::Zero();
  Row variance = Row::Zero();  // of the errors
  Twist twist;                 // of the last motion
  bool hasTwist = false;
  bool exist = false;

  explicit LastingErrors(const ErrorProfile& profile);
};

}  // namespace detail

/// Extended Kalman filter of one point's (x, y, chi) in the current camera frame, at the Cramer-Rao
/// bound from any initial guess.
///
///   predict  (x, y, chi) <- exact flow of the motion,  P <- F P F' + L W L'
///   correct  by the measured (x, y): gate, Huber weight, then the linear Kalman update
///
/// L is the 3x6 matrix of d(x, y, chi)/dt by the twist, W the odometry's noise, both in closed
/// form. The parametrisation is that of Civera, Davison, Montiel, "Inverse Depth Parametrization
/// for Monocular SLAM", IEEE T-RO 24(5), 2008, with the anchor moved along to the current frame, so
/// that the update is linear and odometry noise has its place.
///
/// The prior is wide by default (sigma_chi 5 1/m, or chi when that is more): the guess has no
/// lasting influence. chi is unbounded inside (negative while unobservable); the range applies to
/// what is reported. While sigma_chi is not small against chi use `DepthEstimate::interval()`, not
/// sigma_Z.
///
/// Measured odometry noise stands in the gain and in the innovation at once (errors in variables),
/// which would pull chi to zero while the camera rests. Hence the entries d(x, y)/dchi of F that
/// make the covariance are scaled by rho (OdometryNoise::Step): rest and pure rotation teach
/// nothing. What bias is left is taken back as far as the innovations show the noise to be there;
/// declared noise that is not there does not shift the depth. What they leave open of it is part of
/// the reported sigma.
///
/// Uncertainties that cannot be estimated (odometryScaleSigma, focalSigma) or that one point cannot
/// tell quickly (`lasting`) are considered (Schmidt 1966): the estimate is not touched, the
/// sensitivity of its error to each is carried along, and reported variances contain sensitivity^2
/// sigma^2. SharedErrorFilter learns them.
///
/// After a motion that is not known (`Motion::unknown`) the next measurement says where the point
/// is, and nothing of its depth, whose sigma has grown (see `widened`).
///
/// Status: `lost` behind the camera (the point then starts anew with its next measurement, keeping
/// its depth as a guess) or predicted less precisely than lost_sigma; `unexcited` when the camera
/// rests, when its speed is in the dead band, or when the present motion would make sigma_chi less
/// than 5 % smaller within a second (for a point known better than 1 %, than a sigma of 1 %).
///
/// \code
///   InverseDepthFilter filter;
///   filter.reset({x, y, 0.5 / focal_px}, {2.0});     // any guess of Z [m]
///   filter.predict(Motion::fromTwist(twist, dt));    // for each image
///   filter.correct({x, y, 0.5 / focal_px});
///   const DepthEstimate e = filter.estimate();
/// \endcode
class DEPTHSERVO_API InverseDepthFilter : public DepthEstimator {
 public:
  using Options = InverseDepthFilterOptions;

  explicit InverseDepthFilter(const Options& options = {}, const DepthRange& range = {})
      : options_(options), range_(range), lasting_(options.lasting) {}

  std::unique_ptr<DepthEstimator> clone() const override;
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override;
  void predict(const Motion& motion) override;
  void correct(const PointMeasurement& measurement) override;
  void correctDepth(const DepthPrior& measured) override;
  DepthEstimate estimate() const override;

  /// chi [1/m] without bounds and without anything considered, nor the uncertainty of the bias of
  /// odometry noise: what the filter believes itself.
  double chi() const { return point_.chi; }
  double variance_chi() const { return point_.cc; }

  /// The filter's own covariance of (x, y, chi), 3x3.
  Eigen::Matrix3d covariance() const;

 private:
  PointMeasurement asWhite(const PointMeasurement& measurement) const;
  void followLasting(const Motion& motion, const PointState& before);

  Options options_;
  DepthRange range_;
  detail::FilterPoint point_;
  detail::LastingErrors lasting_;
  OdometryNoise::Step step_;  // of the last motion
  double dt_ = 0;             // of the last motion [s]
};

}  // namespace depthservo
