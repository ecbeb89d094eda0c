#include "observation/SelfDiagnosis.h"

#include <algorithm>
#include <cmath>

#include "depthservo/depth/DepthForecast.h"

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;

ConsistencyMonitor::Options monitorOptions(const OdometryNoise& odometry) {
  ConsistencyMonitor::Options options;
  options.filter.odometry = odometry;
  return options;
}

/// An error is a fault from this many times what is reckoned with (1 sigma), when it is known that
/// well, after this time.
constexpr double kBeyondProfile = 1.4, kKnown_sigma = 4, kLearning_s = 3;

/// Innovations smaller than declared harm nobody: sigma is too large, that is all.
bool isFault(const ConsistencyMonitor::Diagnosis& d) {
  return d.cause != Cause::none && d.cause != Cause::noData &&
         !(d.cause == Cause::noise && d.size < 1);
}

}  // namespace

SelfDiagnosis::SelfDiagnosis(std::size_t capacity, const OdometryNoise& odometry, double sigma,
                             const DepthPrior& prior, const DepthRange& range,
                             const std::optional<JointStates>& joint,
                             const std::optional<SharedErrorFilterOptions>& errors)
    : odometry_(odometry),
      sigma_(sigma),
      joint_(joint),
      monitor_(capacity, monitorOptions(odometry), prior, range) {
  if (errors) learner_.emplace(capacity, *errors, prior, range);
}

/// With a profile: the monitor takes errors for white, so that of its verdicts only those on the
/// motion as a whole count; the others come from a filter that learns the errors which last.
ConsistencyMonitor::Diagnosis SelfDiagnosis::diagnosis() const {
  ConsistencyMonitor::Diagnosis now = monitor_.diagnosis();
  if (!learner_ || now.isMotion() || now.cause == Cause::outliers) return now;
  now.meanNis = learner_->meanNis();
  if (now.cause != Cause::noData) now.cause = Cause::none;
  if (!(time_s_ - first_s_ > kLearning_s)) return now;
  double most = kBeyondProfile;
  const auto consider = [&](Cause cause, const SharedErrorFilter::Shared& error) {
    const double size = std::abs(error.value);
    if (!(error.prior > 0) || size < kKnown_sigma * error.sigma || size < most * error.prior)
      return;
    most = size / error.prior;
    now.cause = cause;
    now.size = cause == Cause::latency || cause == Cause::focalLength ? error.value : size;
    now.evidence = size / error.sigma;
  };
  consider(Cause::latency, learner_->latency());
  for (int axis = 0; axis < 3; ++axis) {
    consider(Cause::gyroBias, learner_->gyroBias(axis));
    consider(Cause::mount, learner_->mount(axis));
  }
  consider(Cause::focalLength, learner_->focal());
  return now;
}

std::optional<std::string> SelfDiagnosis::update(
    double time_s, const MotionBuffer& odometry,
    const std::vector<PointObservation>& observations) {
  const double before_s = std::isnan(time_s_) ? time_s : time_s_;
  const auto [motion, coverage] = odometry.motion(before_s, time_s);
  const bool isFirst = std::isnan(time_s_);
  if (!isFirst && (coverage == Coverage::afterEnd || coverage == Coverage::reversed)) return {};
  if (!isFirst && coverage != Coverage::complete) monitor_.reset();
  motion_ = motion;
  time_s_ = time_s;
  monitor_.predict(motion);
  monitor_.correct(observations);
  if (isFirst) first_s_ = time_s;
  if (learner_) {
    learner_->advance(odometry, time_s);
    learner_->correct(observations);
  }
  varianceFactor_ = std::max(varianceFactor_, varianceFactor());

  const ConsistencyMonitor::Diagnosis now = diagnosis();
  if (!isFault(now)) return {};
  auto known = std::find_if(named_.begin(), named_.end(),
                            [&](const RunDiagnosis& d) { return d.latest.cause == now.cause; });
  const bool isNew = known == named_.end();
  if (isNew) {
    RunDiagnosis first;
    first.first_s = time_s;
    first.isCompensated = joint_ && joint_->estimates(now.cause);
    known = named_.insert(known, first);
  }
  known->latest = now;
  known->named_s += motion.dt;
  if (isNew) return known->message();
  return {};
}

double SelfDiagnosis::varianceFactor() const {
  if (learner_ && !monitor_.diagnosis().isMotion()) return 1;
  const bool isCompensated = joint_ && joint_->estimates(monitor_.diagnosis().cause);
  return isCompensated ? 1 : monitor_.varianceFactor();
}

DepthEstimate SelfDiagnosis::honest(DepthEstimate estimate) const {
  const double factor = varianceFactor();
  if (!(factor > 1)) return estimate;
  estimate.sigma_chi *= std::sqrt(factor);
  const bool isVague = estimate.sigma_chi >= kValidRelativeSigma * estimate.chi;
  if (estimate.status == DepthStatus::valid && isVague) estimate.status = DepthStatus::converging;
  return estimate;
}

double SelfDiagnosis::framesTo5Percent(const DepthEstimate& estimate) const {
  if (estimate.status == DepthStatus::lost) return kUnknown;
  return DepthForecast::of(estimate, sigma_, motion_, odometry_)
      .framesTo(0.05, estimate.chi, estimate.sigma_chi);
}

RunDiagnosis SelfDiagnosis::result() const {
  RunDiagnosis result;
  const auto longest = std::max_element(
      named_.begin(), named_.end(),
      [](const RunDiagnosis& a, const RunDiagnosis& b) { return a.named_s < b.named_s; });
  if (longest != named_.end()) {
    result = *longest;
  } else {
    result.latest = diagnosis();
    const ConsistencyMonitor::Diagnosis& d = result.latest;
    if (d.cause == Cause::none && d.values + d.rejected < ConsistencyMonitor::kFewestValues) {
      result.latest.cause = Cause::noData;
    }
  }
  result.varianceFactor = varianceFactor_;
  return result;
}

}  // namespace depthservo
