#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/MeasurementNoise.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

struct SharedErrorFilterOptions {
  ErrorProfile errors = ErrorProfile::typical();
  double focal_px = 600;  ///< turns the profile's pixels into normalised coordinates [px]
  /// Of a rolling shutter: a point's row over the image's height is rowScale y + rowOffset.
  double rowScale = 0, rowOffset = 0;
  std::size_t places = 8;  ///< points that learn the shared errors together; the others use them
  double gate = 13.8;      ///< as of InverseDepthFilterOptions, likewise the following
  int rejectionsInARow = 5;
  double huber = 2.5;
  double lost_sigma = 0.1;
  /// Whether what shows to be more than the profile's is reckoned with: changes of the twist that
  /// are not followed yet, and slip. A diagnosis shall see them in the innovations.
  bool isCautious = true;
};

/// Extended Kalman filter of points and of the lasting errors of a robot that they share (see
/// ErrorProfile). With (v_o, w_o) a row of the odometry, the camera moves with
///
///   u = (R(m)' v_o (1 + S + s),  R(m)' (w_o - b)),
///
/// and an image is exposed t_d + j before its stamp. The state:
///
///   t_d    latency, constant                      b  gyro bias (3), constant
///   m      rotation of the camera's mount (3)     kappa  true / given focal length
///   S      scale of the translation: considered (Schmidt 1966), as no image can tell it
///   s      slip, first-order Gauss-Markov         j  jitter of this image's stamp, white
///   x, y, chi  of each point at the exposure, in the true camera frame
///   w      wander of each point's tracker (2), first-order Gauss-Markov
///
///   measured = kappa (x, y) + w - (L u)_xy j + noise,
///
/// L the derivative of d(x, y, chi)/dt by the twist. What is not in the profile is not in the
/// state. An error e of the image's pose enters the noise as L cov(e) L': it is common to the
/// points, but while their depths are vague they would learn it with too much confidence. A part
/// that lasts counts the more the longer the point has been seen. The
/// points stand where they are at the exposure, t_d before the stamp: an error of t_d shows only
/// where the twist changes, and a point that starts needs no correlation with it. A change that may
/// be noise of the rows teaches nothing of t_d; what it may do to a point if it is none, is noise.
///
/// So many `places` hold the points that learn the shared errors, spread over the image. Every
/// other point is filtered alone, along the motion corrected by them; the sensitivity of its error
/// to the constant ones is carried along and enters its sigma, the others count as noise.
///
/// Slip that shows to be larger than the profile's is reckoned with as it shows.
///
/// Real-time: no allocation after construction. Where the motion is not known points go on alone.
class DEPTHSERVO_API SharedErrorFilter : public PointSetEstimator {
 public:
  using Options = SharedErrorFilterOptions;
  static constexpr int kNone = -1;

  /// \param capacity greatest number of points
  /// \param prior for points without one of their own
  explicit SharedErrorFilter(std::size_t capacity, const Options& options = {},
                             const DepthPrior& prior = {}, const DepthRange& range = {});

  SharedErrorFilter(const SharedErrorFilter&) =
      default;  // no move: nothing is left without its memory
  SharedErrorFilter& operator=(const SharedErrorFilter&) = default;
  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  bool retire(int id) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  void setNoise(const MeasurementNoise& noise) override;
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return range_; }

  /// An error that the points share.
  struct Shared {
    double value = 0, sigma = 0;  ///< the prior's until it is learnt
    double prior = 0;             ///< 1 sigma; 0: not in the profile
    int index = kNone;            ///< for `correlation`
    double expected = 0;          ///< by the profile
  };
  Shared latency() const;           ///< t_d [s], > 0: images are late
  Shared gyroBias(int axis) const;  ///< [rad/s], axis 0..2
  Shared mount(int axis) const;     ///< [rad], axis 0..2
  Shared focal() const;             ///< kappa - 1 [-]
  Shared slip() const;              ///< [-]
  /// Of the errors of what has been learnt; near 1 or -1 when the motion does not tell them apart.
  double correlation(const Shared& a, const Shared& b) const;

  /// Of the latest innovations of the points at places; 2 when the profile is right.
  double meanNis() const { return nisSum_ / nisWeight_; }
  /// How many of their measurements were used since the start, and how many rejected.
  int values() const { return nisValues_; }
  int rejected() const { return rejected_; }
  /// Share of the latest measurements of these points that was rejected.
  double rejectedShare() const { return rejectedShare_; }
  /// Negative logarithm of the likelihood of the innovations at places since the start, per
  /// innovation, without its constant; outliers count as if they were at the gate. 0: there were
  /// none.
  double cost() const { return innovations() > 0 ? cost_ / innovations() : 0; }
  int innovations() const { return nisValues_ + rejected_; }

 private:
  static constexpr int kMostConstants = 9, kMostShared = 11;
  using ByShared = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostShared>;
  using ByConstants = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostConstants>;

  struct Slot {
    int id = 0;
    bool isStarted = false;
    int place = kNone;
    int unseen = 0;  // images in a row
    DepthPrior prior;
    detail::FilterPoint point;  // covariance: of what is not shared; at a place it is in P_
    ByConstants A;              // d(error of x, y, chi) by the shared constants; not at a place
    Eigen::Vector2d wander = Eigen::Vector2d::Zero();  // at a place
    double first_s = 0;                                // when it was seen first
    double noise = 0;  // variance of a measurement with which the point has come to its covariance
  };
  /// A measurement as predicted, and its derivative by the shared states.
  struct Seen {
    Eigen::Vector2d point;   // without wander
    Eigen::Matrix2d byPose;  // covariance by the error of the pose
    Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostShared> byShared;
  };
  struct Step;

  const Slot* find(int id) const;
  Slot* findOrAdd(int id);
  Slot* slotAt(int place) { return seated_[place] == kNone ? nullptr : &slots_[seated_[place]]; }
  int row(int place) const { return shared_ + perPoint_ * place; }
  int rows() const { return row(places_); }
  double kappa() const { return focal_ == kNone ? 1 : 1 + values_(focal_); }
  double value(int index) const { return index == kNone ? 0 : values_(index); }

  Step stepTo(const MotionBuffer& odometry, double time_s);
  void followTwist(const MotionBuffer& odometry, double begin_s, Step& step);
  void predict(const Step& step);
  ByShared bySharedErrors(const Step& step, const detail::FilterPoint& before,
                          const PointState& after, const Eigen::Matrix3d& F) const;
  void propagate();
  void keepSound();
  void resetShared();
  void renew(int index, double kept, double sigma);
  void letDrift(Slot& slot, const UnknownPart& unknown);
  double noiseOf(const Slot& slot) const;
  void inflate(Slot& slot, double times);

  Seen seen(const Slot& slot) const;
  Eigen::Matrix2d othersAsNoise(const Seen& seen, double wander) const;
  void start(Slot& slot, const PointMeasurement& measurement, const DepthPrior& prior);
  void correctSeated(Slot& slot, const PointMeasurement& measurement);
  void correctAlone(Slot& slot, const PointMeasurement& measurement);
  void apply(const Eigen::Vector2d& nu, int n);
  void symmetrise();
  void moveAlone();
  void learnSlip();
  void forgetSlipped(double more);
  detail::FilterPoint described(const Slot& slot, int place) const;

  void elect();
  void seat(Slot& slot, int place);
  void unseat(Slot& slot);
  void vacate(Slot& slot);
  void clear(int first, int count);

  bool isMount(int index) const { return mount_ != kNone && index >= mount_ && index < mount_ + 3; }
  /// A cov(constants) A'. \param A derivative by the constants
  template <int rows>
  Eigen::Matrix<double, rows, rows> ofConstants(
      const Eigen::Matrix<double, rows, Eigen::Dynamic, 0, rows, kMostConstants>& A) const {
    Eigen::Matrix<double, rows, Eigen::Dynamic, 0, rows, kMostConstants> AP(rows, constants_);
    AP = A.lazyProduct(P_.topLeftCorner(constants_, constants_));
    return AP.lazyProduct(A.transpose());
  }
  double priorOf(int index) const;     // of a constant
  double calibrated(int index) const;  // likewise
  Shared shared(int index, double prior) const;

  Options options_;
  NoiseLevel position_, angle_;  // of poses [m, rad]
  InverseDepthFilterOptions pointOptions_;
  DepthPrior prior_;
  DepthRange range_;
  std::vector<Slot> slots_;  // [0, size_) are in use
  std::size_t size_ = 0;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();

  // Rows of the shared states; the constants come first.
  int latency_ = kNone, bias_ = kNone, mount_ = kNone, focal_ = kNone, scale_ = kNone;
  int slip_ = kNone, jitter_ = kNone;
  int constants_ = 0, shared_ = 0, perPoint_ = 3;
  int places_ = 0;           // highest place in use + 1
  std::vector<int> seated_;  // slot at each place
  Eigen::VectorXd values_;   // of the shared states
  Eigen::VectorXd before_;   // those constants by which the points alone were last moved
  Eigen::MatrixXd P_;
  std::vector<Eigen::Matrix3d> F_;
  std::vector<ByShared> C_;
  std::vector<Eigen::Matrix<double, 3, 6>> G_;  // by unit noise of the odometry
  Eigen::MatrixXd U_, K_, W_;  // of one correction, n x 2; of one prediction, n x 3

  double nisSum_ = 2, nisWeight_ = 1, rejectedShare_ = 0;
  int nisValues_ = 0, rejected_ = 0;
  double cost_ = 0;
  GaussMarkov reckoned_;       // slip: the profile's, or more
  double slipSum_ = 0;         // the variance that shows, times the time that tells it
  double slipTold_s_ = 0;      // this time
  Twist twist_;                // at the last exposure, corrected
  Vector6d steady_;            // told twist there, averaged; NaN: not known
  Vector6d behind_;            // by how much the average is behind the told twist, as white noise
  OdometryNoise::Step noise_;  // of the last motion
  double dt_ = 0;              // of the last motion [s]
};

}  // namespace depthservo
