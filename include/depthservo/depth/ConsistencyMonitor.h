#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

/// Options of ConsistencyMonitor.
struct ConsistencyMonitorOptions {
  InverseDepthFilterOptions filter;  ///< the model whose honesty is watched

  int window = 100;     ///< images over which the NIS is averaged
  double hold_s = 1;    ///< how long the mean NIS must be out of its band [s]
  double memory_s = 3;  ///< time constant of the evidence for each cause [s]
  double evidence = 6;  ///< sigma from which a cause is named
};

/// Tells whether images and odometry agree with what was declared of them, and if not, why.
///
/// It runs a filter of its own for each point. With the right model the innovations nu are white,
/// with covariance S, so that NIS = nu' S^-1 nu averages 2. For each cause h that a wrong model can
/// have, the sensitivity s = d nu/d theta_h is carried along the filter (linear, exact to first
/// order: e <- F e + G_h, e <- (I - K H) e), and with the score of each image
/// b = sum s' S^-1 nu over its points,
///
///     size theta_h = sum b / sum s' S^-1 s,   evidence = |sum b| / sqrt(sum b^2)
///
/// The evidence is self-normalised: it keeps its meaning when the declared noise is wrong or shared
/// by all points. Of the causes with enough of it, the one that explains most is named. Causes:
/// images late against the odometry; gyro bias (3 axes); focal length; target moving with constant
/// velocity (3 axes). Where most of what is wrong stays unexplained and many measurements are
/// rejected, the motion is not that of these images (frame, sign, unit, clock). Beside these: the
/// share of rejected measurements (outliers), and a mean NIS out of its band for another reason
/// (noise). A verdict over too few values is no agreement: noData.
///
/// No allocation but in `message()`; contract as for PointSetEstimator.
class DEPTHSERVO_API ConsistencyMonitor {
 public:
  using Options = ConsistencyMonitorOptions;

  enum class Cause {
    none,
    latency,       ///< size: time by which the images are late [s]
    gyroBias,      ///< size: [rad/s]
    focalLength,   ///< size: true / declared - 1 [-]
    movingTarget,  ///< size: speed [m/s]
    outliers,      ///< size: share of rejected measurements [-]
    noise,         ///< size: mean NIS / 2; above 1: more noise than declared
    motion,  ///< the motion does not explain the images at all; size: share of rejected ones [-]
    frame,   ///< the same, and explained by other axes or signs of the motion
    clock,   ///< the same, and explained by another clock; size: odometry is early by this [s]
    unit,    ///< the same, and explained by another unit; size: factor for the motion [-]
    poseConvention,  ///< the same, and explained by poses of another convention
    mount,  ///< the camera is mounted otherwise than said; size: angle [rad]. Not of this monitor
    slip,   ///< the wheels slip; size: 1 sigma, a share of the speed [-]. Not of this monitor
    poseNoise,  ///< poses that tell the motion err more than allowed; size: 1 sigma per axis [m].
                ///< Not of this monitor
    noData,     ///< too few measurements could be compared; size: their number
  };

  /// Those whose effect on a depth is known, see `chiBy`.
  static constexpr std::array kModelled = {Cause::latency, Cause::gyroBias, Cause::focalLength,
                                           Cause::movingTarget};

  /// As printed: none | latency | gyro-bias | focal-length | moving-target | outliers | noise |
  /// motion | frame | clock | unit | pose-convention | mount | slip |
  /// pose-noise | no-data.
  static const char* toString(Cause cause);
  /// Unit of the size: "s", "rad/s", "rad", "m/s" or "" for ratios and numbers.
  static const char* unitOf(Cause cause);

  struct Diagnosis {
    Cause cause = Cause::none;
    double size = 0;            ///< see Cause
    double evidence = 0;        ///< [sigma]; for outliers and noise: how far out of the band
    double meanNis = 2;         ///< over the window; 2 is expected
    int values = 0;             ///< in that mean
    int rejected = 0;           ///< measurements of the window beyond the gate, not in the mean
    Cause rival = Cause::none;  ///< another that explains nearly as much: motion tells them apart

    /// Whether the motion does not explain the images at all, be it known why or not.
    bool isMotion() const;

    /// The cause with its evidence and what to do, in one sentence.
    std::string message() const;
  };

  /// \param capacity greatest number of points
  explicit ConsistencyMonitor(std::size_t capacity, const Options& options = {},
                              const DepthPrior& prior = {}, const DepthRange& range = {});
  ConsistencyMonitor(const ConsistencyMonitor&);
  ConsistencyMonitor& operator=(const ConsistencyMonitor&) = delete;
  ~ConsistencyMonitor();

  void reset();

  /// Camera motion since the last image, as for DepthEstimator.
  void predict(const Motion& motion);

  /// The points measured in the image taken now.
  void correct(const std::vector<PointObservation>& observations);

  /// Forgets a point whose id will not come again.
  void retire(int id);

  /// Starts every point anew with its next measurement: the motion since the last is not known.
  /// What was learnt of the causes stays.
  void forgetPoints() { size_ = 0; }

  /// What is wrong at present.
  Diagnosis diagnosis() const;

  /// Over all images since the start.
  struct Total {
    int accepted = 0, rejected = 0;  ///< measurements
    double meanNis = 2;              ///< of all, each at most kCappedNis
    double rejectedShare() const { return rejected / std::max(1., double(accepted) + rejected); }
  };
  static constexpr double kCappedNis = 100;
  static constexpr int kFewestValues = 20;  ///< measurements without which there is no verdict
  Total total() const;

  /// Factor >= 1 for reported variances: mean NIS / 2 while that is above its band. While a wrong
  /// model is the cause, or most measurements are rejected, those count too.
  double varianceFactor() const;

  /// By how much a point's inverse depth is too small [1/m] because of a cause, at its size, if
  /// that is named now or, with less evidence, the likeliest; of one that lasts, if it was ever
  /// named. 0 for others, and for a point that is not known.
  double chiBy(Cause cause, int id) const;

 private:
  // Hypotheses: latency, gyro bias x y z, focal length, target velocity x y z.
  static constexpr int kHypotheses = 8;
  struct Slot;
  using Vector = Eigen::Matrix<double, kHypotheses, 1>;
  using Square = Eigen::Matrix<double, kHypotheses, kHypotheses>;
  struct Fit {
    double explained = 0, evidence = 0, size = 0;
    Eigen::Vector3d theta = Eigen::Vector3d::Zero();  // of one cause the first
  };
  using Fits = std::array<Fit, kModelled.size()>;  // in the order of kModelled
  struct Likeliest {
    Cause cause = Cause::none;
    Fit fit;
    Cause next = Cause::none;
    double explainedByNext = 0;
  };
  struct Image {
    double sum = 0;  // of NIS
    int count = 0;
    double far = 0;  // sum of NIS of rejected ones
    int farCount = 0;
  };
  struct Nis {
    double mean = 2, deviation = 0;  // in sigma of the mean
    int values = 0;
  };

  Slot* findOrAdd(int id);
  void predictSlot(Slot& slot, const Motion& motion);
  void correctSlot(Slot& slot, const PointMeasurement& measurement);
  void startSlot(Slot& slot, const PointMeasurement& measurement, const DepthPrior& prior);
  Image windowed() const;
  Nis windowedNis() const;
  void countRejected(double nis);
  Fit fitted(int first, int count) const;
  Fits fits() const;
  Likeliest likeliest(const Fits& fits, double evidence) const;
  Diagnosis judged(const Fits& fits) const;
  void noteSizes(const Fits& fits);
  double judgeModel(const Fits& fits, Diagnosis& d) const;
  void judgeNoise(Diagnosis& d) const;

  Options options_;
  DepthPrior prior_;
  DepthRange range_;
  std::vector<Slot> slots_;  // [0, size_) are in use
  std::size_t size_ = 0;

  std::vector<Image> images_;  // ring of the last `window`
  std::size_t next_ = 0;
  Image current_;
  Vector score_ = Vector::Zero();  // of the current image
  // With forgetting: scores, their products, and what scores of unit size would be.
  Vector sum_ = Vector::Zero();
  Square square_ = Square::Zero(), information_ = Square::Zero();
  double measured_ = 0, rejected_ = 0;  // with forgetting
  double far_ = 0, excess_ = 0;         // the same: beyond the gate; sum of weighted NIS - 2
  Image all_;                           // since the start, each NIS capped
  double above_s_ = 0, below_s_ = 0;    // how long the mean NIS has been out of its band

  Diagnosis latest_;               // of the last image
  double held_s_ = 0;              // how long its cause has been the same
  Vector sizes_ = Vector::Zero();  // of the hypotheses that were named or are suspected
  std::array<bool, kModelled.size()> wasNamed_ = {};

  OdometryNoise::Step step_;
  Eigen::Matrix3d startRcamera_ = Eigen::Matrix3d::Identity();
  // Recent mean twists, newest first, and their count: for the latency's sensitivity.
  std::array<Vector6d, 4> twists_ = {};
  int twistCount_ = 0;
  bool isMoving_ = false;  // by more than measured noise
  double dt_ = 0, sinceCorrection_s_ = 0;
};

}  // namespace depthservo
