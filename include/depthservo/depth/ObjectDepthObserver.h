#pragma once

#include <limits>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObserverStep.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

/// The nonlinear observer of De Luca, Oriolo and Robuffo Giordano 2008 (see NonlinearDepthObserver)
/// with one depth for a whole object: all its points are taken to be equally far away. For n
/// measured points (x_i, y_i) and the common chi,
///
///   predict   (x_i, y_i, chi_i) <- flow,   chi <- mean of the chi_i
///   correct   nu_i = measured - predicted,   c_i = d(x_i, y_i)/dchi
///             (x_i, y_i) += (1 - p1 p2) nu_i
///             chi        += (1 - p1)(1 - p2) (sum c_i.nu_i)/(sum c_i.c_i)
///
/// with the poles p_i of s^2 + k s + k_3 W^2, W^2 the mean of the points' W_i^2: the gain k_3/n on
/// the sum of all points, so the same gains serve as for one point alone.
///
/// Why: a servo law that uses points whose depths contradict each other can come to rest far from
/// its goal, and at rest nothing corrects them. With one depth it cannot. A plate seen at a slant
/// is not equally far everywhere: its points then have its mean depth, which costs the servo
/// nothing, but a depth of one point is off by as much as the plate is deep. sigma_chi does not
/// know of that.
///
/// A point hidden while others are seen coasts at the corrected depth; a new point starts with the
/// depth of the object. `setPrior` for a point that was measured starts the object's depth anew
/// (the mean of the priors given between two images).
class DEPTHSERVO_API ObjectDepthObserver : public PointSetEstimator {
 public:
  using Options = NonlinearObserverOptions;

  /// \param capacity greatest number of points
  /// \param prior of the object, while no point has one of its own
  explicit ObjectDepthObserver(std::size_t capacity, const Options& options = {},
                               const DepthPrior& prior = {}, const DepthRange& range = {});

  ObjectDepthObserver(const ObjectDepthObserver&) = default;  // no move: nothing is left without its memory
  ObjectDepthObserver& operator=(const ObjectDepthObserver&) = default;
  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return range_; }

  /// Observations ignored because the capacity was used up.
  std::size_t ignored() const { return ignored_; }

 private:
  /// `unset`: never measured, or to start anew with its next measurement.
  using Phase = detail::ObserverPhase;

  struct Point {
    int id = 0;
    Phase phase = Phase::unset;
    Eigen::Vector2d s = Eigen::Vector2d::Zero();  // (x, y)
    Eigen::Vector2d c = Eigen::Vector2d::Zero();  // d(x, y)/dchi since it was measured
    double elapsed_s = 0;                         // since then
    double W = 0;                                 // excitation over the last motion [m/s]
    double odometryVariance = 0;                  // since then, of one image axis
    Eigen::Vector2d nu = Eigen::Vector2d::Zero();
    bool isUsed = false;    // in the correction at hand
    int rejections = 0;     // in a row
    bool isAdrift = false;  // the motion since it was measured is not known

    bool isFollowed() const { return phase != Phase::unset && phase != Phase::gone; }
  };

  const Point* find(int id) const;
  Point* findOrAdd(int id);
  void predict(const Motion& motion);
  void forgetPoints();
  void letDrift(const UnknownPart& unknown);
  void startObject(double measurementVariance);
  void start(Point& point, const PointMeasurement& measurement);
  void take(Point& point, const PointMeasurement& measurement);
  void apply(double variance);
  double positionVariance(const Point& point) const;

  Options options_;
  DepthPrior prior_;
  DepthRange range_;
  std::vector<Point> points_;  // [0, size_) are in use
  std::size_t size_ = 0, ignored_ = 0;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();

  bool isStarted_ = false;  // chi_ is more than a guess
  double chi_ = 1;
  double priorChiSum_ = 0, priorSigmaSum_ = 0;  // of what was given since the last image
  int priors_ = 0;

  detail::LineVariance variance_;  // along the points' c, stacked; at the last correction
  double g_ = 1;                   // dchi/dchi since then
  double elapsed_s_ = 0;
  double rho_ = 1;
  detail::PoleMatchedGains gains_;
  double W_ = 0;  // over the last motion [m/s]
  detail::ExcitationWindow window_;
  bool isMotionKnown_ = true;  // of the last motion
};

}  // namespace depthservo
