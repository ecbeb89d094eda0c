#include "observation/SelfDiagnosis.h"

#include <algorithm>
#include <array>
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

/// An error is a fault from this many times what is reckoned with (1 sigma; for a vector, of each
/// of its components), when it is known that well, after this time.
constexpr double kLatencyBeyond = 1.4, kFocalBeyond = 2, kGyroBeyond = 1.4, kMountBeyond = 1.75;
constexpr double kKnown_sigma = 4, kLearning_s = 3;

/// With a profile that knows a robot better than most, errors are compared with this share of the
/// usual ones.
constexpr double kSmallShare = 0.25;

/// Images without which the learner's NIS says nothing.
constexpr int kFewestImages = 30;

/// The same of slip, of which there are few independent values, once the others are known.
constexpr double kSlipBeyond = 1.8, kSlipLearning_s = 6;

/// Errors that are correlated by more than this are not told apart.
constexpr double kTied = 0.8;

/// Share of measurements that a filter which reckons with the profile rejects, and mean NIS of the
/// others, when the motion is not that of the images. Stamps that jitter much reach half of either.
constexpr double kManyRejected = 0.3, kUnexplainedNis = 2.9;

/// Mean NIS of that filter beyond which what it has learnt of constant errors is not known as well
/// as it believes, and beyond which noise is larger than the profile's. Within `typical` it is
/// below 1.8, within a calibrated profile about 2.
constexpr double kDoubtfulNis = 2.1, kNoisyNis = 2.6;

/// Rejections that good measurements may have.
constexpr double kFewRejected = 5, kRejectedShare = 0.005;

/// Where less than this share of the slip's variance is learnt, nothing is said of it.
constexpr double kTellingSlip = 0.2;

/// Innovations smaller than declared harm nobody: sigma is too large, that is all.
bool isFault(const ConsistencyMonitor::Diagnosis& d) {
  return d.cause != Cause::none && d.cause != Cause::noData &&
         !(d.cause == Cause::noise && d.size < 1);
}

}  // namespace

/// A learnt error against what is reckoned with.
struct SelfDiagnosis::Learnt {
  Cause cause;
  double size = 0, times = 0, evidence = 0;  // times: of what counts as beyond the profile
  SharedErrorFilter::Shared error;           // of a vector the component that is known best
};

SelfDiagnosis::Learnt SelfDiagnosis::learntOf(Cause cause, const SharedErrorFilter::Shared& e,
                                              double fault) {
  if (!(e.prior > 0)) return {cause, 0, 0, 0, e};
  const double size = std::abs(e.value - e.expected);
  return {cause, e.value, size / fault, size / e.sigma, e};
}

SelfDiagnosis::Learnt SelfDiagnosis::learntOf(
    Cause cause, const std::array<SharedErrorFilter::Shared, 3>& components, double fault) {
  Learnt learnt{cause, 0, 0, 0, components[0]};
  if (!(components[0].prior > 0)) return learnt;
  double square = 0;
  for (const SharedErrorFilter::Shared& e : components) {
    const double size = std::abs(e.value - e.expected);
    square += std::max(0., size * size - e.sigma * e.sigma);  // of what is known
    const double evidence = size / e.sigma;
    if (evidence <= learnt.evidence) continue;
    learnt.evidence = evidence;
    learnt.error = e;
  }
  learnt.size = std::sqrt(square);
  learnt.times = learnt.size / fault;
  return learnt;
}

SelfDiagnosis::SelfDiagnosis(std::size_t capacity, const OdometryNoise& odometry, double sigma,
                             const DepthPrior& prior, const DepthRange& range,
                             const std::optional<JointStates>& joint,
                             const std::optional<SharedErrorFilterOptions>& errors)
    : odometry_(odometry),
      sigma_(sigma),
      joint_(joint),
      monitor_(capacity, monitorOptions(odometry), prior, range) {
  if (!errors) return;
  SharedErrorFilterOptions options = *errors;
  options.isCautious = false;
  learner_.emplace(capacity, options, prior, range);
  slipTau_s_ = errors->errors.slip.tau_s;
}

/// With a profile: the monitor takes errors for white, so that of its verdicts only those count on
/// which a filter that learns the lasting errors agrees; the others come from that filter.
ConsistencyMonitor::Diagnosis SelfDiagnosis::diagnosis() const {
  ConsistencyMonitor::Diagnosis now = monitor_.diagnosis();
  if (!learner_ || isMotionWrong()) return now;
  if (now.cause == Cause::outliers && hasOutliers()) return now;
  const Cause white = now.cause, whiteRival = now.rival;
  now.meanNis = learner_->meanNis();
  now.values = learner_->values();
  now.rival = Cause::none;
  if (now.cause != Cause::noData) now.cause = Cause::none;
  if (!(time_s_ - first_s_ > kLearning_s)) return now;
  if (nis_.images > kFewestImages && nis_.mean() > kDoubtfulNis) {
    if (!(nis_.mean() > kNoisyNis)) return now;
    if (white == Cause::movingTarget) return monitor_.diagnosis();
    now.cause = Cause::noise;
    now.size = nis_.mean() / 2;
    now.evidence = (nis_.mean() - 2) * std::sqrt(nis_.images) / 2;  // points have it in common
    return now;
  }
  nameLearnt(now);
  if (now.rival == Cause::none && now.cause == white) now.rival = whiteRival;
  return now;
}

bool SelfDiagnosis::isMotionWrong() const {
  if (!monitor_.diagnosis().isMotion()) return false;
  return !learner_ || learner_->rejectedShare() > kManyRejected ||
         learner_->meanNis() > kUnexplainedNis;
}

bool SelfDiagnosis::hasOutliers() const {
  const int rejected = learner_->rejected(), all = learner_->values() + rejected;
  return rejected > kFewRejected + kRejectedShare * all;
}

/// Names the learnt error that exceeds what is reckoned with by most.
void SelfDiagnosis::nameLearnt(ConsistencyMonitor::Diagnosis& d) const {
  const SharedErrorFilter& f = *learner_;
  const ErrorProfile usual = ErrorProfile::typical();
  // From which size on it is one; what is small for any robot never is.
  const auto fault = [](double times, const SharedErrorFilter::Shared& error, double usually) {
    return times * std::max(error.prior, kSmallShare * usually);
  };
  const std::array<Learnt, 5> all{
      learntOf(Cause::latency, f.latency(), fault(kLatencyBeyond, f.latency(), usual.latency_s)),
      learntOf(Cause::focalLength, f.focal(), fault(kFocalBeyond, f.focal(), usual.focal)),
      learntOf(Cause::gyroBias, {f.gyroBias(0), f.gyroBias(1), f.gyroBias(2)},
               fault(kGyroBeyond, f.gyroBias(0), usual.gyroBias_rad_s)),
      learntOf(Cause::mount, {f.mount(0), f.mount(1), f.mount(2)},
               fault(kMountBeyond, f.mount(0), usual.mount_rad)),
      learntSlip()};
  const Learnt* named = nullptr;
  for (const Learnt& learnt : all) {
    if (learnt.evidence < kKnown_sigma || learnt.times < (named ? named->times : 1)) continue;
    named = &learnt;
  }
  if (!named) return;
  d.cause = named->cause;
  d.size = named->size;
  d.evidence = named->evidence;
  double closest = kTied;
  for (const Learnt& other : all) {
    const double tied = std::abs(f.correlation(named->error, other.error));
    if (&other == named || tied < closest) continue;
    closest = tied;
    d.rival = other.cause;
  }
}

/// How much the slip that was learnt exceeds what it would be with the profile's sigma.
SelfDiagnosis::Learnt SelfDiagnosis::learntSlip() const {
  Learnt learnt{Cause::slip, 0, 0, 0, learner_->slip()};
  const double prior = learnt.error.prior;
  if (!(expectedSlip2_ > kTellingSlip * prior * prior * slipped_s_)) return learnt;
  const double ratio = slipped2_ / expectedSlip2_;
  learnt.size = std::sqrt(ratio) * prior;
  learnt.times = std::sqrt(ratio) / kSlipBeyond;
  learnt.evidence = (ratio - 1) * std::sqrt(slipped_s_ / (2 * slipTau_s_));  // independent values
  return learnt;
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
    if (time_s - first_s_ > kLearning_s) {
      nis_.sum += learner_->meanNis();
      ++nis_.images;
    }
    const SharedErrorFilter::Shared slip = learner_->slip();
    if (slip.prior > 0 && time_s - first_s_ > kSlipLearning_s) {
      slipped2_ += motion.dt * slip.value * slip.value;
      expectedSlip2_ += motion.dt * (slip.prior * slip.prior - slip.sigma * slip.sigma);
      slipped_s_ += motion.dt;
    }
  }
  factor_ = varianceFactor();
  greatestFactor_ = std::max(greatestFactor_, factor_);

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

/// While the profile does not explain the innovations sigma reckons with what does, by the monitor
/// or by their size.
double SelfDiagnosis::varianceFactor() const {
  if (learner_ && !isMotionWrong()) {
    if (!(learner_->meanNis() > kNoisyNis)) return 1;
    const bool isMoving = monitor_.diagnosis().cause == Cause::movingTarget;
    return isMoving ? monitor_.varianceFactor() : learner_->meanNis() / 2;
  }
  const bool isCompensated = joint_ && joint_->estimates(monitor_.diagnosis().cause);
  return isCompensated ? 1 : monitor_.varianceFactor();
}

/// How far the point's inverse depth is off by what nobody reckons with or learns [1/m].
double SelfDiagnosis::chiByCauses(int id) const {
  double square = 0;
  for (const Cause cause : ConsistencyMonitor::kModelled) {
    const bool isKnown = learner_ ? cause != Cause::movingTarget || !(factor_ > 1)
                                  : joint_ && joint_->estimates(cause);
    const double off = isKnown ? 0 : monitor_.chiBy(cause, id);
    square += off * off;
  }
  return std::sqrt(square);
}

DepthEstimate SelfDiagnosis::honest(int id, DepthEstimate estimate) const {
  const double off = chiByCauses(id);
  if (!(factor_ > 1) && !(off > 0)) return estimate;
  estimate.sigma_chi = std::hypot(std::sqrt(factor_) * estimate.sigma_chi, off);
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
  result.varianceFactor = greatestFactor_;
  return result;
}

}  // namespace depthservo
