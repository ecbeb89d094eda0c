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

/// A cause is named from this many times what is reckoned with (1 sigma).
constexpr double kBeyondProfile = 1.4;

}  // namespace

SelfDiagnosis::SelfDiagnosis(std::size_t capacity, const OdometryNoise& odometry, double sigma,
                             const DepthPrior& prior, const DepthRange& range,
                             const std::optional<JointStates>& joint,
                             const std::optional<ErrorProfile>& errors)
    : odometry_(odometry),
      sigma_(sigma),
      joint_(joint),
      errors_(errors),
      monitor_(capacity, monitorOptions(odometry), prior, range) {}

bool SelfDiagnosis::isFault(const ConsistencyMonitor::Diagnosis& d) const {
  if (!errors_) {
    // Innovations smaller than declared harm nobody: sigma is too large, that is all.
    return d.cause != Cause::none && d.cause != Cause::noData &&
           !(d.cause == Cause::noise && d.size < 1);
  }
  // The monitor takes errors for white: what of them lasts is no fault within the profile, and a
  // target that moves or more noise than declared cannot be told from it.
  switch (d.cause) {
    case Cause::latency:
      return std::abs(d.size) > kBeyondProfile * errors_->latency_s;
    case Cause::gyroBias:
      return std::abs(d.size) > kBeyondProfile * errors_->gyroBias_rad_s;
    case Cause::focalLength:
      return std::abs(d.size) > kBeyondProfile * errors_->focal;
    case Cause::none:
    case Cause::noData:
    case Cause::noise:
    case Cause::movingTarget:
      return false;
    default:
      return true;
  }
}

std::optional<std::string> SelfDiagnosis::see(double time_s, const MotionBuffer& odometry,
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
  if (errors_) return 1;
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
    if (errors_ && !isFault(result.latest) && result.latest.cause != Cause::noData) {
      result.latest.cause = Cause::none;
    }
    const ConsistencyMonitor::Diagnosis& d = result.latest;
    if (d.cause == Cause::none && d.values + d.rejected < ConsistencyMonitor::kFewestValues) {
      result.latest.cause = Cause::noData;
    }
  }
  result.varianceFactor = varianceFactor_;
  return result;
}

}  // namespace depthservo
