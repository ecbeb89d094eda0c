#include "depthservo/pose/VisualMotionObserver.h"

#include <algorithm>
#include <cmath>

#include "pose/ImagePose.h"

namespace depthservo {
namespace {

constexpr std::size_t kFewestPoints = 4;

/// Images in a row that may contradict the estimate before it is given up.
constexpr int kRefusalsInARow = 5;

/// Position uncertainty of a hidden point (normalised) at which it is lost.
constexpr double kLostSigma = 0.1;

/// Largest image coordinate (normalised) that a camera can see.
constexpr double kLargestTangent = 1e6;

/// Farthest target [m] that still counts as an estimate.
constexpr double kFarthest_m = 1e9;

constexpr int kMostCouplingSteps = 1000;

double squared(double x) { return x * x; }

bool isPose(const Eigen::Isometry3d& g) {
  if (!g.matrix().allFinite() || !(g.translation().norm() < kFarthest_m)) return false;
  const Eigen::Matrix3d R = g.linear();
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
         R.determinant() > 0;
}

Eigen::Isometry3d pose(const Motion& motion) {
  Eigen::Isometry3d g;
  g.linear() = motion.R;
  g.translation() = motion.t;
  g.makeAffine();
  return g;
}

/// exp(u h).
Eigen::Isometry3d exponential(const Vector6d& u, double h) {
  return pose(Motion::fromTwist({u.head<3>(), u.tail<3>()}, -h));
}

/// The greatest value also where the numbers have failed.
double bounded(double sigma, double most) { return sigma >= 0 && sigma < most ? sigma : most; }

}  // namespace

const char* toString(ImageVerdict verdict) {
  switch (verdict) {
    case ImageVerdict::none:
      return "no image yet";
    case ImageVerdict::accepted:
      return "accepted";
    case ImageVerdict::tooFewPoints:
      return "fewer than four points of the target";
    case ImageVerdict::behindCamera:
      return "target behind or too near to the camera";
    case ImageVerdict::degenerate:
      return "points in a line, or in a plane with the camera";
    case ImageVerdict::rotationTooLarge:
      return "turned too far from the estimate";
    case ImageVerdict::inconsistent:
      return "no pose near the estimate explains the points";
  }
  return "";
}

VisualMotionObserver::VisualMotionObserver(std::vector<Eigen::Vector3d> points,
                                           const Options& options, const DepthRange& range)
    : points_(std::move(points)), options_(options), range_(range), measured_(points_.size()) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points_) sum += p.squaredNorm();
  size_ = sum > 0 ? std::sqrt(sum / static_cast<double>(points_.size())) : 1;
  reset();
}

std::unique_ptr<PointSetEstimator> VisualMotionObserver::clone() const {
  return std::make_unique<VisualMotionObserver>(*this);
}

void VisualMotionObserver::reset() {
  std::fill(measured_.begin(), measured_.end(), detail::SeenPoint{});
  seen_ = ignored_ = 0;
  startDistance_ = DepthPrior().Z;
  verdict_ = ImageVerdict::none;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  longestGap_s_ = 0;
  hasGuess_ = options_.cMo && reset(*options_.cMo);
  if (!hasGuess_) {
    Eigen::Isometry3d ahead = Eigen::Isometry3d::Identity();
    ahead.translation().z() = startDistance_;
    reset(ahead);
    hasGuess_ = false;
  }
}

bool VisualMotionObserver::reset(const Eigen::Isometry3d& cMo) {
  if (!isPose(cMo)) return false;
  cMo_ = cMo;
  hasGuess_ = true;
  isStarted_ = isOnImage_ = isAdrift_ = false;
  phase_ = Phase::unset;
  e_e_.setZero();
  lag_.setZero();
  P_.setZero();
  C_.setZero();
  elapsed_s_ = corrected_ = 0;
  refusals_ = 0;
  return true;
}

bool VisualMotionObserver::setPrior(int id, const DepthPrior& prior) {
  if (!isKnown(id)) return false;
  startDistance_ = prior.sanitised(range_).Z;
  if (!hasGuess_) cMo_.translation().z() = startDistance_;
  return true;
}

void VisualMotionObserver::correctDepth(int /*id*/, const DepthPrior& /*measured*/) {}

/// How long the held correction still acts [s].
double VisualMotionObserver::heldFor() const {
  if (!isStarted_) return 0;
  const bool isGuarded = options_.lostFrames == Options::LostFrames::guarded;
  return isGuarded ? std::max(0.0, (1 - corrected_) / options_.ke)
                   : std::numeric_limits<double>::infinity();
}

/// The pose after a camera motion, with the held correction.
Eigen::Isometry3d VisualMotionObserver::moved(const Motion& motion) const {
  const double held_s = std::min(motion.dt, heldFor());
  if (!options_.coupledGoal) return pose(motion) * cMo_ * exponential(options_.ke * e_e_, held_s);

  const Eigen::Isometry3d oMcd = options_.coupledGoal->inverse();
  const double wanted = std::ceil(motion.dt / options_.couplingStep_s * (1 - 1e-6));
  const int steps = static_cast<int>(std::clamp(wanted, 1.0, double{kMostCouplingSteps}));
  const double h = motion.dt / steps;
  const Eigen::Isometry3d part =
      steps == 1 ? pose(motion) : pose(Motion::fromTwist(motion.twist(), h));
  Eigen::Isometry3d g = cMo_;
  for (int i = 0; i < steps; ++i) {
    const Eigen::Isometry3d g_ce = oMcd * g;
    const Vector6d u_e = options_.ke * (e_e_ - rotated(g_ce.linear().transpose(), poseError(g_ce)));
    g = part * g * exponential(u_e, std::clamp(held_s - i * h, 0.0, h));
  }
  return g;
}

Coverage VisualMotionObserver::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {  // the first image: nothing to move yet
    if (!std::isfinite(time_s)) return Coverage::reversed;
    time_s_ = time_s;
    return Coverage::complete;
  }
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) return coverage;
  if (hasMotion(coverage)) {
    if (!(motion.dt > 0)) return coverage;
    Eigen::Isometry3d next = moved(motion);
    detail::orthonormalise(next);
    corrected_ += options_.ke * std::min(motion.dt, heldFor());
    elapsed_s_ += motion.dt;
    if (isPose(next)) {
      cMo_ = next;
      if (isStarted_) phase_ = Phase::coasting;
      if (motion.unknown.exists()) letDrift(motion.unknown);
    } else {
      phase_ = Phase::lost;
      isStarted_ = false;
    }
  } else {  // how the camera moved will never be known
    reset(Eigen::Isometry3d(cMo_));
  }
  isOnImage_ = false;
  time_s_ = time_s;
  return coverage;
}

/// No correction goes on, and the error may be as large as the camera has moved.
void VisualMotionObserver::letDrift(const UnknownPart& unknown) {
  constexpr double kSigmasOfBound = 2;
  const double turned = std::min(unknown.angle_rad / kSigmasOfBound, kLargestRotation);
  const double moved = std::min(
      unknown.distance_m / kSigmasOfBound + turned * cMo_.translation().norm(), kFarthest_m);
  C_ = covariance(corrected_);
  for (int i = 0; i < 6; ++i) {
    const double sigma = std::sqrt(std::max(0.0, C_(i, i)));
    C_(i, i) += squared(sigma + (i < 3 ? moved : turned)) - squared(sigma);
  }
  P_ = C_;
  e_e_.setZero();
  corrected_ = 1;
  isAdrift_ = true;
}

Eigen::Isometry3d VisualMotionObserver::cMo(const MotionBuffer& odometry, double time_s) const {
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  if (!hasMotion(coverage)) return cMo_;
  const Eigen::Isometry3d later = moved(motion);
  return isPose(later) ? later : cMo_;
}

void VisualMotionObserver::take(const std::vector<PointObservation>& observations) {
  std::fill(measured_.begin(), measured_.end(), detail::SeenPoint{});
  seen_ = 0;
  for (const PointObservation& observation : observations) {
    if (!isKnown(observation.id) || measured_[static_cast<std::size_t>(observation.id)].isSeen) {
      ++ignored_;
      continue;
    }
    const PointMeasurement& m = observation.measurement;
    if (!m.isUsable() || !(std::hypot(m.x, m.y) < kLargestTangent)) continue;
    measured_[static_cast<std::size_t>(observation.id)] = {m, true};
    ++seen_;
  }
  isOnImage_ = true;
}

void VisualMotionObserver::correct(const std::vector<PointObservation>& observations) {
  take(observations);
  if (seen_ < kFewestPoints) {
    verdict_ = ImageVerdict::tooFewPoints;
    if (isStarted_) phase_ = Phase::coasting;
    return;
  }
  if (!hasGuess_) {
    cMo_ = detail::ImagePose(points_, measured_, size_, range_.Z_min).facing(startDistance_);
  }
  const detail::PoseStep step = imageStep();
  step.verdict == ImageVerdict::accepted ? accept(step) : refuse(step.verdict);
}

bool VisualMotionObserver::correctPose(const Eigen::Isometry3d& cMo, const Matrix6d& covariance) {
  if (!isPose(cMo) || !(covariance.norm() < kFarthest_m)) return false;
  isOnImage_ = false;
  detail::PoseStep step;
  step.covariance = covariance;
  step.error = poseError(cMo_.inverse() * cMo);
  step.shown = cMo;
  accept(step);
  return true;
}

/// The pose error that the image shows, by the method that is good enough for it.
detail::PoseStep VisualMotionObserver::imageStep() const {
  const detail::ImagePose image(points_, measured_, size_, range_.Z_min);
  if (options_.method == ImageErrorMethod::iterated || takesPose()) return image.iterated(cMo_);
  const detail::PoseStep step = image.step(cMo_, options_.method);
  if (step.verdict != ImageVerdict::accepted || std::isinf(options_.iterateAbove_rad)) return step;
  const bool isGood =
      step.error.tail<3>().norm() <= options_.iterateAbove_rad && image.explains(step);
  return isGood ? step : image.iterated(cMo_);
}

bool VisualMotionObserver::takesPose() const {
  return (!isStarted_ || isAdrift_) && options_.start == Options::Start::takePose;
}

void VisualMotionObserver::accept(const detail::PoseStep& step) {
  if (takesPose()) {
    cMo_ = step.shown;
    e_e_.setZero();
    lag_.setZero();
    P_ = step.covariance;
    corrected_ = 1;
  } else {
    e_e_ = step.error;
    if (isStarted_) {
      P_ = covariance(corrected_);
      lag_ += std::min(1.0, options_.ke * elapsed_s_) * (e_e_ - lag_);
      longestGap_s_ = std::max(longestGap_s_, elapsed_s_);
    } else {
      P_ = step.covariance;
      lag_ = e_e_;
    }
    corrected_ = 0;
  }
  C_ = step.covariance;
  residual_ = step.residual;
  elapsed_s_ = 0;
  refusals_ = 0;
  isStarted_ = hasGuess_ = true;
  isAdrift_ = false;
  phase_ = Phase::tracking;
  verdict_ = ImageVerdict::accepted;
}

void VisualMotionObserver::refuse(ImageVerdict verdict) {
  verdict_ = verdict;
  const bool mayPass = verdict == ImageVerdict::degenerate || verdict == ImageVerdict::inconsistent;
  if (isStarted_ && mayPass && ++refusals_ <= kRefusalsInARow) {
    phase_ = Phase::rejected;
    return;
  }
  if (isStarted_ || verdict != ImageVerdict::degenerate) phase_ = Phase::lost;
  isStarted_ = false;
}

/// Of the estimate's error from pixel noise: that of the pose before the last image and that of the
/// image, mixed as far as the correction has come.
Matrix6d VisualMotionObserver::covariance(double corrected) const {
  return squared(1 - corrected) * P_ + squared(corrected) * C_;
}

/// The point where this pose has it, with the sigmas of that time; its status does not change,
/// unless it is out of sight.
DepthEstimate VisualMotionObserver::estimateAt(const Instant& instant, int id) const {
  DepthEstimate e;
  const Eigen::Vector3d& p = points_[static_cast<std::size_t>(id)];
  const Eigen::Vector3d cP = instant.cMo * p;
  const double chi = 1 / std::max(cP.z(), range_.Z_min);
  e.x = chi * cP.x();
  e.y = chi * cP.y();
  e.chi = range_.clampChi(chi);
  if (phase_ == Phase::unset) return e;

  const Matrix6d noise = covariance(instant.corrected);
  const double unmeasured = std::max(1.0, options_.ke * instant.elapsed_s);
  const auto variance = [&](const Vector6d& J) {
    return J.dot(noise * J) + squared(unmeasured * J.dot(lag_));
  };
  const Eigen::Matrix3d R = instant.cMo.linear();
  const Eigen::Vector3d sight = R.row(2).transpose();
  const double var_x = variance(detail::byPoseError(chi * (R.row(0).transpose() - e.x * sight), p));
  const double var_y = variance(detail::byPoseError(chi * (R.row(1).transpose() - e.y * sight), p));
  const double sigma_Z = std::sqrt(variance(detail::byPoseError(sight, p)));
  e.sigma_chi = bounded(squared(e.chi) * sigma_Z, DepthPrior::kLargestSigma_chi);
  e.sigma_xy = bounded(std::sqrt(0.5 * (var_x + var_y)), PointMeasurement::kLargestSigma);

  const detail::SeenPoint& measured = measured_[static_cast<std::size_t>(id)];
  const bool isHidden = !isOnImage_ || !measured.isSeen || phase_ == Phase::coasting;
  const bool isAhead = cP.z() >= range_.Z_min;
  if (phase_ == Phase::lost || !isAhead || (isHidden && e.sigma_xy > kLostSigma)) {
    e.status = DepthStatus::lost;
  } else if (isHidden) {
    e.status = DepthStatus::coasting;
  } else if (phase_ == Phase::rejected) {
    e.status = DepthStatus::rejected;
  } else {
    const bool isPrecise = e.sigma_chi < kValidRelativeSigma * e.chi;
    e.status = isPrecise ? DepthStatus::valid : DepthStatus::converging;
  }
  return e;
}

DepthEstimate VisualMotionObserver::estimate(int id) const {
  if (!isKnown(id)) {
    DepthEstimate unknown;
    unknown.chi = range_.clampChi(unknown.chi);
    return unknown;
  }
  DepthEstimate e = estimateAt({cMo_, elapsed_s_, corrected_}, id);
  const detail::SeenPoint& measured = measured_[static_cast<std::size_t>(id)];
  if (isOnImage_ && measured.isSeen) {
    e.x = measured.point.x;
    e.y = measured.point.y;
    e.sigma_xy = measured.point.sigma;
  }
  return e;
}

DepthEstimate VisualMotionObserver::estimate(int id, const MotionBuffer& odometry,
                                             double time_s) const {
  const auto [motion, coverage] = odometry.motion(time_s_, time_s);
  if (!isKnown(id) || !hasMotion(coverage) || !(motion.dt > 0)) return estimate(id);
  const Eigen::Isometry3d later = moved(motion);
  if (!isPose(later)) return estimate(id);
  const double share = options_.ke * std::min(motion.dt, heldFor());
  DepthEstimate e = estimateAt({later, elapsed_s_ + motion.dt, corrected_ + share}, id);
  const detail::SeenPoint& measured = measured_[static_cast<std::size_t>(id)];
  if (isOnImage_ && measured.isSeen) {  // from where it was seen, as the model moves it
    const DepthEstimate then = estimateAt({cMo_, elapsed_s_, corrected_}, id);
    e.x += measured.point.x - then.x;
    e.y += measured.point.y - then.y;
  }
  if (motion.unknown.exists()) {
    const PointSigmas wide = widened({e.sigma_xy, e.sigma_chi}, {e.x, e.y, e.chi}, motion.unknown);
    e.sigma_xy = wide.xy;
    e.sigma_chi = wide.chi;
    e.status = whileMotionIsUnknown(e.status);
  }
  return e;
}

double VisualMotionObserver::depthErrorBound(int id) const {
  if (!isKnown(id) || !isStarted_) return std::numeric_limits<double>::infinity();
  const double sine = std::min(1.0, e_e_.tail<3>().norm());
  const double twiceSineOfHalf = std::sqrt(2 * (1 - std::sqrt(1 - sine * sine)));
  const double distance = points_[static_cast<std::size_t>(id)].norm();
  return e_e_.head<3>().norm() + twiceSineOfHalf * distance;
}

}  // namespace depthservo
