#pragma once

#include <Eigen/Core>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/depth/ObserverStep.h"
#include "depthservo/motion/Motion.h"

namespace depthservo {

/// Image point in pixels from the principal point, both axes in the same pixels:
/// y1 = u - cx, y2 = (v - cy) fx/fy.
struct CentredPixel {
  double y1 = 0, y2 = 0;  ///< [px]
  double sigma = 0;       ///< standard deviation per axis [px]

  static constexpr double kLargest = 1e5, kLargestSigma = 1e4;

  /// Finite and not above the largest, with sigma >= 0.
  bool isUsable() const {
    return std::abs(y1) <= kLargest && std::abs(y2) <= kLargest && sigma >= 0 &&
           sigma <= kLargestSigma;
  }
};

/// Gains of the focal length observer, for pixels.
///
/// k_3 (wx^2 + wy^2) and k_4 (c1^2 + c2^2) are the squared natural frequencies of the errors of
/// lambda and of 1/lambda, c = y (y2 wx - y1 wy).
struct DEPTHSERVO_API FocalGains {
  double k = 30;      ///< k_1 = k_2 [1/s], > 0
  double k_3 = 1500;  ///< [-], >= 0
  double k_4 = 1e-5;  ///< [1/px^4], >= 0

  /// Critically damped, settled to 2 % in `settling_s` when the camera turns at `turnRate`
  /// [rad/s], root mean square across the optical axis, and the point is `radius_px` off it.
  static FocalGains fromSettlingTime(double settling_s, double turnRate, double radius_px);
};

/// Focal lengths that may be estimated [px]; lambda is kept in [0, largest_px] and 1/lambda in
/// [0, 1/smallest_px]. The error can only shrink by it.
struct FocalRange {
  double smallest_px = 10;  ///< > 0
  double largest_px = 1e5;
};

struct FocalObserverOptions {
  FocalGains gains;
  FocalRange range;

  /// Window of the excitation measures [s].
  double window_s = 1;

  /// Unexcited: at the pace of the last window the error would take longer than this to fall to
  /// 1/e [s].
  double slowest_s = 30;

  /// A measurement is rejected when it is farther from the prediction than `gate_sigma` standard
  /// deviations and than `gate_px`; after `rejectionsInARow` it is believed all the same.
  double gate_sigma = 6, gate_px = 20;
  int rejectionsInARow = 5;

  /// Standard deviations of what is not known at the start: of lambda [px], of 1/lambda [1/px].
  double sigma_focal_px = 2000, sigma_inverseFocal = 0.01;
};

/// A focal length and what it is worth.
struct FocalEstimate {
  double y1 = 0, y2 = 0;      ///< the point, from the principal point [px]
  double focal_px = 0;        ///< lambda; 0 while nothing is known
  double inverseFocal = 0;    ///< 1/lambda as estimated on its own [1/px]
  double sigma_focal_px = 0;  ///< 1 sigma under the image noise; without that of a translation
  double eta1 = 0, eta2 = 0;  ///< y1 wx + y2 wy and y2 wx - y1 wy over the last motion [px rad/s]
  double sigma_min = 0;       ///< least singular value of the windowed integral of Omega Omega^T
  double decayRate = 0;       ///< of the error of lambda, at the pace of the last window [1/s]
  DepthStatus status = DepthStatus::unset;

  /// lambda times 1/lambda, which are estimated independently: 1 when both are right.
  double consistency() const { return focal_px * inverseFocal; }
};

/// Observer of a camera's focal length lambda [px] from a point's image while the camera turns
/// about its optical centre: De Luca, Oriolo and Robuffo Giordano, "Feature Depth Observation for
/// Image-based Visual Servoing", IJRR 27(10), 2008, eq. 19-24, with the state (y1, y2, lambda,
/// 1/lambda). Under a rotation w the point moves as
///
///     (y1, y2)' = Omega^T (lambda, 1/lambda) + wz (y2, -y1),    Omega = [[-wy, wx], [c1, c2]],
///     c = (y1, y2) (y2 wx - y1 wy),                             det Omega = -eta1 eta2,
///
/// so the error dynamics are linear, and converge from anywhere when the motion is exciting: wx or
/// wy is needed, rotation about the optical axis tells nothing, and neither the point nor the point
/// turned by a quarter about the axis may keep its depth (eta1 eta2 = 0) all the time.
///
/// Sampled without integration error, so that any gain is stable at any frame rate:
///
///   predict   y <- ((R11 y1 + R12 y2 + R13 lambda), ...) / ((R31 y1 + R32 y2)/lambda + R33)
///   correct   nu = measured - predicted,   B = dy/d(lambda, 1/lambda) over Dt
///             y                  += (1 - exp(-k Dt)) nu
///             (lambda, 1/lambda) += D W^T f(W W^T) nu,   W = B D/Dt,   D^2 = diag(k_3, k_4)
///
/// where f(s^2) = (1 - p1)(1 - p2)/(s^2 Dt), p_i = exp(s_i Dt), s_i the roots of s^2 + k s + s^2_W:
/// for each singular value of W the poles of the continuous observer.
///
/// A camera that sits r ahead of the centre of rotation sees lambda (1 + r/Z) instead: see
/// `compensatedFocal`. Distortion must have been removed.
///
/// Real-time: nothing allocates, locks, prints or throws; any input is allowed; what it gives is
/// always finite. Copies are independent. One thread per object.
class DEPTHSERVO_API FocalLengthObserver {
 public:
  using Options = FocalObserverOptions;

  explicit FocalLengthObserver(const Options& options = {});

  /// Starts anew at this measurement. Ignored when it is not usable. \param focal_px a guess, 0
  /// when there is none \rtsafe
  void reset(const CentredPixel& measured, double focal_px = 0);

  /// Follows the camera's rotation since the last `predict`; its translation is not used. Motions
  /// that are not usable are ignored. \rtsafe
  void predict(const Motion& motion);

  /// Corrects with the image taken now; refers to all motion since the last `correct`. \rtsafe
  void correct(const CentredPixel& measured);

  /// Instead of `correct`, when the motion since the last one is not known: goes on from this
  /// measurement with the focal length at hand. \rtsafe
  void resume(const CentredPixel& measured);

  FocalEstimate estimate() const;  ///< \rtsafe

 private:
  using Phase = detail::ObserverPhase;

  /// Where the rotation since the last correction has taken the point.
  struct Prediction {
    Eigen::Vector2d y = Eigen::Vector2d::Zero();
    Eigen::Matrix2d B = Eigen::Matrix2d::Zero();  ///< dy/d(lambda, 1/lambda)
    bool ahead = false;
  };
  Prediction predicted() const;
  Eigen::Matrix4d predictedCovariance(const Eigen::Matrix2d& B) const;
  void restart(const CentredPixel& measured);
  void startFrom(const CentredPixel& measured);

  /// Windowed information on lambda with 1/lambda unknown [rad^2/s].
  double informationOnFocal() const;

  Options options_;
  Phase phase_ = Phase::unset;
  Eigen::Vector2d y_ = Eigen::Vector2d::Zero();           // at the last correction [px]
  Eigen::Vector2d lambda_ = Eigen::Vector2d::Zero();      // (lambda, 1/lambda)
  Eigen::Matrix4d covariance_ = Eigen::Matrix4d::Zero();  // of (y, lambda, 1/lambda), likewise
  Eigen::Matrix3d R_ = Eigen::Matrix3d::Identity();       // since then
  double elapsed_s_ = 0;
  double eta1_ = 0, eta2_ = 0;
  Eigen::Matrix2d gramian_ = Eigen::Matrix2d::Zero();  // windowed Omega Omega^T
  double windowFilled_ = 0;                            // 0..1
  int rejections_ = 0;                                 // in a row
};

/// lambda of a camera whose optical centre is `lever_m` ahead of the axis it turns about, from what
/// the observer gave for a point at depth Z [m]: focal_px / (1 + lever_m/Z).
DEPTHSERVO_API double compensatedFocal(double focal_px, double lever_m, double Z);

}  // namespace depthservo
