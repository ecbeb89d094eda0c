#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/ConsistencyMonitor.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Watches a run or a replay: whether images and odometry agree with what was declared of them, and
/// when each depth will be known.
class DEPTHSERVO_INNER SelfDiagnosis {
 public:
  /// \param sigma of a measurement, normalised [-]
  /// \param errors that the estimator reckons with; none: white noise
  /// \param joint of the joint filter: what it learns does no harm to its depths
  SelfDiagnosis(std::size_t capacity, const OdometryNoise& odometry, double sigma,
                const DepthPrior& prior, const DepthRange& range,
                const std::optional<JointStates>& joint,
                const std::optional<SharedErrorFilterOptions>& errors);

  /// Takes the points of an image. Returns what there is to say for the first time.
  std::optional<std::string> update(double time_s, const MotionBuffer& odometry,
                                    const std::vector<PointObservation>& observations);

  /// A point that will not come again.
  void retire(int id) {
    monitor_.retire(id);
    if (learner_) learner_->retire(id);
  }

  /// The estimate with its variance inflated by mean NIS / 2 while innovations are larger than
  /// declared, or than the profile explains, and by what the causes named or suspected do to it.
  DepthEstimate honest(int id, DepthEstimate estimate) const;

  /// More images like the last until sigma_Z is below 5 % of Z; 0: it is; infinite: never.
  double framesTo5Percent(const DepthEstimate& estimate) const;

  /// On the whole: the cause that was named longest.
  RunDiagnosis result() const;

 private:
  OdometryNoise odometry_;
  double sigma_;
  std::optional<JointStates> joint_;
  std::optional<SharedErrorFilter> learner_;  // with a profile of errors
  ConsistencyMonitor monitor_;
  Motion motion_;  // since the last image
  double time_s_ = kUnknown, first_s_ = kUnknown;
  std::vector<RunDiagnosis> named_;  // by cause
  double varianceFactor() const;
  double chiByCauses(int id) const;
  ConsistencyMonitor::Diagnosis diagnosis() const;
  bool isMotionWrong() const;
  bool hasOutliers() const;

  struct Learnt;
  static Learnt learntOf(ConsistencyMonitor::Cause cause, const SharedErrorFilter::Shared& error,
                         double fault);
  static Learnt learntOf(ConsistencyMonitor::Cause cause,
                         const std::array<SharedErrorFilter::Shared, 3>& components, double fault);
  Learnt learntSlip() const;
  void nameLearnt(ConsistencyMonitor::Diagnosis& d) const;

  double factor_ = 1, greatestFactor_ = 1;  // of variances, after the last image and over all
  struct {
    double sum = 0;
    int images = 0;
    double mean() const { return images > 0 ? sum / images : 2; }
  } nis_;                                    // of the learner, once it has learnt
  double slipped2_ = 0, expectedSlip2_ = 0;  // slip^2 over time: learnt, and by the profile [s]
  double slipped_s_ = 0, slipTau_s_ = 0;
};

}  // namespace depthservo
