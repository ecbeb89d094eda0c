#pragma once

#include <array>
#include <limits>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

/// Options of JointDepthFilter; all of it works as it stands.
struct JointDepthFilterOptions {
  /// Odometry, gate, weights and considered uncertainties, as of each point alone. focalSigma is
  /// not used while the focal length is estimated.
  InverseDepthFilterOptions filter;

  bool estimateTimeOffset = true;      ///< how late the images are against the odometry
  double timeOffsetSigma_s = 1. / 30;  ///< prior [s]: about a frame

  bool estimateGyroBias = false;      ///< constant error of the measured angular velocity
  double gyroBiasSigma_rad_s = 0.01;  ///< prior, per axis [rad/s]

  bool estimateFocal = false;  ///< ratio of the true focal length to the one given
  double focalSigma = 0.1;     ///< prior [-]
};

/// Extended Kalman filter of up to eight points that share the odometry's error, and of what else
/// they have in common. The state is (x, y, chi) of each point, in the current camera frame, and
///
///   t_d    image late against the odometry: the motion between two images is that of the odometry
///          over [t0 - t_d, t1 - t_d]; derivative F L(before) u(t0 - t_d) - L(after) u(t1 - t_d)
///   b      gyro bias (3): true angular velocity = measured - b
///   kappa  true / given focal length: measured (x, y) = kappa (x, y)
///
/// The state holds kappa (x, y, chi), which moves as (x, y, chi) does with Z / kappa instead of Z:
/// the measurement is then linear and motion without information on kappa leaves it untouched.
///
/// with dense covariance: P <- F P F' + G W G', G the stacked 3x6 matrices L of all points. Noise
/// of translation and rotation moves all points at once, hence is largely recognised as such; the
/// joint bound can be several times below that of points alone.
///
/// Each common state is observed or not, see `timeOffset()` and the like: t_d needs a changing
/// twist, kappa general motion. The time offset is not touched while its information would be
/// odometry noise only (camera at rest, twist constant within the noise). The scale of the
/// translation is never observable: declare `filter.odometryScaleSigma`.
///
/// Above eight points the best-conditioned subset is joint: points spread over the image first,
/// then those whose depth is known best; the others are filtered alone, along the motion corrected
/// by t_d and b. For reporting, (x, y) are those of the camera as given (kappa applied).
///
/// With measured odometry noise of a motion that hardly changes, noise still passes for change in
/// part: t_d is pulled towards a fraction of a frame, and sigma can be 1.4 times too small, in the
/// long run (free-approach.yaml) 2.7 times. Where images are known to be in time, do not estimate
/// it: sigma is then right.
///
/// Real-time: no allocation after construction; about 1.3 us a frame for 4 points, 4 us for 8.
class DEPTHSERVO_API JointDepthFilter : public PointSetEstimator {
 public:
  using Options = JointDepthFilterOptions;

  static constexpr std::size_t kJointPoints = 8;

  /// \param capacity greatest number of points
  /// \param prior for points without one of their own
  explicit JointDepthFilter(std::size_t capacity, const Options& options = {},
                            const DepthPrior& prior = {}, const DepthRange& range = {});

  JointDepthFilter(const JointDepthFilter&) = default;  // no move: nothing is left without its memory
  JointDepthFilter& operator=(const JointDepthFilter&) = default;
  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  bool retire(int id) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return range_; }

  /// A state common to all points.
  struct Common {
    double value = 0, sigma = 0;  ///< the prior's until observed; sigma 0 when not estimated
    bool isEstimated = false;
    bool isObserved = false;  ///< sigma is below a quarter of the prior's
  };
  Common timeOffset() const;        ///< [s], > 0: images are late
  Common gyroBias(int axis) const;  ///< [rad/s], axis 0..2
  Common focal() const;             ///< kappa [-]

  /// Whether the point is one of the jointly filtered.
  bool isJoint(int id) const;

  /// Observations ignored because the capacity was used up.
  std::size_t ignored() const { return ignored_; }

 private:
  static constexpr int kCommon = 5;  // t_d, b, kappa
  static constexpr int kSize = kCommon + 3 * static_cast<int>(kJointPoints);
  static constexpr int kStride = 32;
  static constexpr int kNone = -1;
  using Row = std::array<double, kStride>;
  using Square = std::array<Row, kSize>;

  struct Slot {
    int id = 0;
    bool isStarted = false;
    int place = kNone;  // among the joint points
    int unseen = 0;     // images in a row
    DepthPrior prior;
    // When it is joint, times kappa, and covariance and sensitivities are in P_ and so on.
    detail::FilterPoint point;
  };
  struct PointStep;
  struct ShiftedMotion;

  const Slot* find(int id) const;
  Slot* findOrAdd(int id);
  Slot* slotAt(int place) { return joint_[place] == kNone ? nullptr : &slots_[joint_[place]]; }

  int row(int place) const { return common_ + 3 * place; }
  int rows() const { return common_ + 3 * places_; }
  double kappa() const { return focal_ == kNone ? 1 : values_[focal_]; }
  bool isConsideringFocal() const { return focal_ == kNone && options_.filter.focalSigma > 0; }

  ShiftedMotion shiftedMotion(const MotionBuffer& odometry, double t0_s, double t1_s);
  void predict(const ShiftedMotion& shifted);
  void findAcceleration(const MotionBuffer& odometry, double end_s, ShiftedMotion& shifted);
  double shareOfMotion(double size2, double variance) const;
  PointStep stepOf(const Slot& slot, const ShiftedMotion& shifted, const Motion& seen,
                   const PointState& after) const;
  void propagate(const std::array<PointStep, kJointPoints>& steps);

  void start(Slot& slot, const PointMeasurement& measurement, const DepthPrior& prior);
  void correctJoint(Slot& slot, const PointMeasurement& measurement);
  void takePlace(Slot& slot);
  void addToState(const Row& k, double nu);
  void elect();
  void join(Slot& slot);
  void leave(Slot& slot);
  void clearPlace(int place);

  detail::FilterPoint described(const Slot& slot) const;
  Common common(int index, double prior) const;

  Options options_;
  DepthPrior prior_;
  DepthRange range_;
  std::vector<Slot> slots_;  // [0, size_) are in use
  std::size_t size_ = 0, ignored_ = 0;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();

  // Indices of the common states, kNone when not estimated; common_ of them.
  int timeOffset_ = kNone, bias_ = kNone, focal_ = kNone, common_ = 0;
  int places_ = 0;                            // highest place in use + 1
  std::array<int, kJointPoints> joint_ = {};  // slot at each place
  std::array<double, kCommon> values_ = {};
  Square P_ = {};
  Row scale_ = {}, focalSensitivity_ = {};  // d(error of the state) by either considered parameter

  // Change of the twist (linear, angular) over noise, squared, running mean; by stretch. < 0: none.
  static constexpr int kStretches = 3;
  std::array<std::array<double, 2>, kStretches> change_ = {};

  OdometryNoise::Step step_;  // of the last motion
  double dt_ = 0;             // of the last motion [s]
};

}  // namespace depthservo
