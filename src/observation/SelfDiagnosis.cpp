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

/// Innovations smaller than declared harm nobody: sigma is too large, that is all.
bool isFault(const ConsistencyMonitor::Diagnosis& d) {
  return d.cause != Cause::none && d.cause != Cause::noData &&
         !(d.cause == Cause::noise && d.size < 1);
}

}  // namespace

SelfDiagnosis::SelfDiagnosis(std::size_t capacity, const OdometryNoise& odometry, double sigma,
                             const DepthPrior& prior, const DepthRange& range,
                             const std::optional<JointStates>& joint)
    : odometry_(odometry),
      sigma_(sigma),
      joint_(joint),
      monitor_(capacity, monitorOptions(odometry), prior, range) {}

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
  varianceFactor_ = std::max(varianceFactor_, varianceFactor());

  const ConsistencyMonitor::Diagnosis now = monitor_.diagnosis();
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
    result.latest = monitor_.diagnosis();
    const ConsistencyMonitor::Diagnosis& d = result.latest;
    if (d.cause == Cause::none && d.values + d.rejected < ConsistencyMonitor::kFewestValues) {
      result.latest.cause = Cause::noData;
    }
  }
  result.varianceFactor = varianceFactor_;
  return result;
}

}  // namespace depthservo
