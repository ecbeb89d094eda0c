#include "depthservo/depth/JointDepthFilter.h"

#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

using detail::FilterPoint;
using detail::Verdict;
using Phase = FilterPoint::Phase;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A common state is observed when its sigma is below this share of the prior's.
constexpr double kObserved = 0.25;

/// kappa stays within this factor.
constexpr double kFocalRange = 3;

/// The time offset stays within this many sigma of its prior.
constexpr double kOffsetRange = 6;

/// Stretches of odometry whose means tell how the twist changes, in image periods.
constexpr double kStretch[] = {1, 2, 5};

/// The twist changes when its change, squared, is on average over this time so many times what
/// noise alone would give. Single changes count up to a limit, so as to be forgotten in time.
constexpr double kChangeMemory_s = 0.5, kChanges = 3, kLargestChange = 1000;

/// Images without a joint point before another may take its place.
constexpr int kPatience = 15;

/// A point joins instead of another when its relative sigma is less than this share of its.
constexpr double kBetter = 0.5;

Vector6d stacked(const Twist& twist) {
  Vector6d u;
  u << twist.linear, twist.angular;
  return u;
}

/// Lengths of rows in loops: whole vectors.
int padded(int n) { return (n + 3) / 4 * 4; }

/// States beyond this are not numbers to work with.
constexpr double kLargestState = 1e6;

/// The motion as it acts on (kappa x, kappa y, kappa chi): a point with its Z divided by kappa.
Motion asMeasured(const Motion& motion, double kappa) {
  Motion seen = motion;
  if (kappa == 1) return seen;
  seen.R.topRightCorner<2, 1>() *= kappa;
  seen.R.bottomLeftCorner<1, 2>() /= kappa;
  seen.t(2) /= kappa;
  return seen;
}

}  // namespace

/// The motion of the exposures, which are t_d earlier than the images' times.
struct JointDepthFilter::ShiftedMotion {
  Motion motion;
  Vector6d acceleration = Vector6d::Zero();  // of the twist, at its end
  double accelerationVariance[2] = {0, 0};   // of each component of it, linear and angular
  double missing_s = 0;                      // share of t_d for which there is no odometry
};

/// Derivatives of one point's prediction.
struct JointDepthFilter::PointStep {
  double F[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // by its state, parallax scaled by rho
  double parallax[2] = {0, 0};                         // the same, not scaled
  double C[3][kCommon] = {};                           // by the common states
  double G[3][6] = {};                                 // by unit noise
  double scale[3] = {0, 0, 0};                         // by the scale of the translation
};

JointDepthFilter::JointDepthFilter(std::size_t capacity, const Options& options,
                                   const DepthPrior& prior, const DepthRange& range)
    : options_(options), prior_(prior), range_(range), slots_(capacity) {
  if (options_.estimateTimeOffset) timeOffset_ = common_++;
  if (options_.estimateGyroBias) {
    bias_ = common_;
    common_ += 3;
  }
  if (options_.estimateFocal) focal_ = common_++;
  reset();
}

std::unique_ptr<PointSetEstimator> JointDepthFilter::clone() const {
  return std::make_unique<JointDepthFilter>(*this);
}

void JointDepthFilter::reset() {
  size_ = ignored_ = 0;
  time_s_ = std::numeric_limits<double>::quiet_NaN();
  places_ = 0;
  joint_.fill(kNone);
  values_.fill(0);
  for (Row& r : P_) r.fill(0);
  scale_.fill(0);
  focalSensitivity_.fill(0);
  const auto prior = [this](int index, double value, double sigma) {
    values_[index] = value;
    P_[index][index] = sigma * sigma;
  };
  if (timeOffset_ != kNone) prior(timeOffset_, 0, options_.timeOffsetSigma_s);
  for (int i = 0; bias_ != kNone && i < 3; ++i) prior(bias_ + i, 0, options_.gyroBiasSigma_rad_s);
  if (focal_ != kNone) prior(focal_, 1, options_.focalSigma);
  for (auto& ofStretch : change_) ofStretch.fill(-1);
  step_ = {};
  dt_ = 0;
}

// --- Slots

const JointDepthFilter::Slot* JointDepthFilter::find(int id) const {
  const auto end = slots_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto slot = std::find_if(slots_.begin(), end, [id](const Slot& s) { return s.id == id; });
  return slot == end ? nullptr : &*slot;
}

JointDepthFilter::Slot* JointDepthFilter::findOrAdd(int id) {
  if (const Slot* known = find(id)) return &slots_[static_cast<std::size_t>(known - slots_.data())];
  if (size_ == slots_.size()) return nullptr;
  Slot& slot = slots_[size_++];
  slot = {};
  slot.id = id;
  slot.prior = prior_;
  return &slot;
}

bool JointDepthFilter::setPrior(int id, const DepthPrior& prior) {
  Slot* slot = findOrAdd(id);
  if (!slot) return false;
  leave(*slot);
  slot->prior = prior;
  slot->isStarted = false;
  return true;
}

bool JointDepthFilter::isJoint(int id) const {
  const Slot* slot = find(id);
  return slot && slot->place != kNone;
}

// --- Prediction

bool JointDepthFilter::retire(int id) {
  const Slot* known = find(id);
  if (!known) return false;
  const auto index = static_cast<std::size_t>(known - slots_.data());
  leave(slots_[index]);
  slots_[index] = slots_[--size_];
  if (index < size_ && slots_[index].place != kNone) {
    joint_[slots_[index].place] = static_cast<int>(index);
  }
  return true;
}

Coverage JointDepthFilter::advance(const MotionBuffer& odometry, double time_s) {
  if (std::isnan(time_s_)) {  // the first image: nothing to move yet
    if (!std::isfinite(time_s)) return Coverage::reversed;
    time_s_ = time_s;
    return Coverage::complete;
  }
  const Coverage coverage = odometry.coverage(time_s_, time_s);
  switch (coverage) {
    case Coverage::afterEnd:
    case Coverage::reversed:
      return coverage;
    case Coverage::complete:
    case Coverage::hole:
    case Coverage::ended:
    case Coverage::refused:
      predict(shiftedMotion(odometry, time_s_, time_s));
      break;
    case Coverage::empty:
    case Coverage::beforeStart:
      for (std::size_t i = 0; i < size_; ++i) {
        Slot& slot = slots_[i];
        leave(slot);
        if (slot.isStarted) slot.prior = {1 / range_.clampChi(slot.point.chi)};
        slot.isStarted = false;
      }
      break;
  }
  time_s_ = time_s;
  return coverage;
}

JointDepthFilter::ShiftedMotion JointDepthFilter::shiftedMotion(const MotionBuffer& odometry,
                                                                double t0_s, double t1_s) {
  ShiftedMotion shifted;
  const double wanted = timeOffset_ == kNone ? 0 : values_[timeOffset_];
  // What is not known yet must wait, but for what never will be.
  const bool isComplete = odometry.coverage(t0_s, t1_s) == Coverage::complete;
  double offset = isComplete ? std::max(wanted, t1_s - odometry.end()) : wanted;
  auto interval = odometry.motion(t0_s - offset, t1_s - offset);
  if (!hasMotion(interval.coverage)) {
    offset = 0;
    interval = odometry.motion(t0_s, t1_s);
  }
  shifted.motion = interval.motion;
  shifted.missing_s = wanted - offset;
  if (timeOffset_ != kNone && shifted.motion.dt > 0) {
    findAcceleration(odometry, t1_s - offset, shifted);
  }
  if (bias_ != kNone) {  // half of it before, half after: exact to second order
    const Eigen::Vector3d b(values_[bias_], values_[bias_ + 1], values_[bias_ + 2]);
    const Eigen::Matrix3d half =
        Motion::fromTwist({Eigen::Vector3d::Zero(), -b}, 0.5 * shifted.motion.dt).R;
    shifted.motion.R = half * shifted.motion.R * half;
    shifted.motion.t = half * shifted.motion.t;
  }
  return shifted;
}

void JointDepthFilter::predict(const ShiftedMotion& shifted) {
  const Motion& motion = shifted.motion;
  if (!motion.isFinite() || !(motion.dt > 0) || !shifted.acceleration.allFinite()) {
    return;
  }
  step_ = options_.filter.odometry.over(motion);
  dt_ = motion.dt;
  if (timeOffset_ != kNone) {  // what an error of t_d does along an acceleration that is not known
    const double variance = dt_ * dt_ * P_[timeOffset_][timeOffset_];
    step_.variance_t += variance * shifted.accelerationVariance[0];
    step_.variance_theta += variance * shifted.accelerationVariance[1];
  }

  if (motion.unknown.exists()) {  // each point on its own then, and joint again after an image
    for (std::size_t i = 0; i < size_; ++i) leave(slots_[i]);
  }
  const detail::FilterStep step(motion, step_);
  const Motion seen = asMeasured(motion, kappa());
  const bool isSane = step_.variance_t + step_.variance_theta < kLargestState &&
                      shifted.acceleration.squaredNorm() < kLargestState * kLargestState;
  std::array<PointStep, kJointPoints> steps;
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (slot.place == kNone) {
      detail::predictPoint(slot.point, step, options_.filter);
      continue;
    }
    const auto [after, isAhead] = flow(seen, {slot.point.x, slot.point.y, slot.point.chi});
    if (!isSane || !isAhead ||
        !(std::abs(after.x) + std::abs(after.y) + std::abs(after.chi) < kLargestState)) {
      leave(slot);
      slot.point.phase = Phase::behind;
      continue;
    }
    PointStep& s = steps[slot.place];
    s = stepOf(slot, shifted, seen, after);
    slot.point.x = after.x;
    slot.point.y = after.y;
    slot.point.chi = after.chi;
    if (timeOffset_ != kNone) {
      slot.point.x += s.C[0][timeOffset_] * shifted.missing_s;
      slot.point.y += s.C[1][timeOffset_] * shifted.missing_s;
      slot.point.chi += s.C[2][timeOffset_] * shifted.missing_s;
    }
    slot.point.parallax2 = s.parallax[0] * s.parallax[0] + s.parallax[1] * s.parallax[1];
    slot.point.phase = Phase::coasting;
  }
  propagate(steps);
  for (int place = 0; place < places_; ++place) {  // a point whose numbers have failed starts anew
    Slot* slot = slotAt(place);
    const int p = row(place);
    const double xx = P_[p][p], yy = P_[p + 1][p + 1], cc = P_[p + 2][p + 2];
    const bool isSound = xx > 0 && yy > 0 && cc > 0 && xx + yy + cc < detail::kLargestVariance;
    if (!slot || isSound) continue;
    clearPlace(place);
    leave(*slot);
    slot->point.phase = Phase::behind;
  }
}

/// As OdometryNoise::Step::rho, of a part of the motion with this variance per component.
double JointDepthFilter::shareOfMotion(double size2, double variance) const {
  const OdometryNoise& noise = options_.filter.odometry;
  if (noise.mode == OdometryMode::commanded || !(variance > 0)) return 1;
  return size2 > 0 ? std::max(0., 1 - noise.deadBand * noise.deadBand * variance / size2) : 0;
}

JointDepthFilter::PointStep JointDepthFilter::stepOf(const Slot& slot, const ShiftedMotion& shifted,
                                                     const Motion& seen,
                                                     const PointState& after) const {
  const PointState before{slot.point.x, slot.point.y, slot.point.chi};
  const Eigen::Matrix3d F = flowJacobian(seen, before, after);
  const double k = kappa();
  const Eigen::Matrix<double, 3, 6> L = k * rateByTwist({after.x / k, after.y / k, after.chi / k});
  const double sigma_t = std::sqrt(step_.variance_t), sigma_theta = std::sqrt(step_.variance_theta);
  const double afterState[] = {0, 0, after.chi};
  PointStep s;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      s.F[i][j] = F(i, j) * (j == 2 && i < 2 ? step_.rho : 1);
      s.G[i][j] = L(i, j) * sigma_t;
      s.G[i][j + 3] = L(i, j + 3) * sigma_theta;
      if (bias_ != kNone) s.C[i][bias_ + j] = -shifted.motion.dt * L(i, j + 3);
    }
    s.scale[i] = before.chi * F(i, 2) - afterState[i];
  }
  s.parallax[0] = F(0, 2);
  s.parallax[1] = F(1, 2);
  if (timeOffset_ != kNone) {
    const Eigen::Vector3d byOffset = -shifted.motion.dt * (L * shifted.acceleration);
    for (int i = 0; i < 3; ++i) s.C[i][timeOffset_] = byOffset[i];
  }
  if (focal_ != kNone) {
    // q = R m + t chi in the flow, R and t depending on kappa; their noise must not pass for
    // motion.
    const Motion& motion = shifted.motion;
    const double tilt2 = motion.R.topRightCorner<2, 1>().squaredNorm(), t_z = motion.t(2);
    const Eigen::Matrix3d R = shareOfMotion(tilt2, step_.variance_theta) * motion.R;
    const double t3 = shareOfMotion(t_z * t_z, step_.variance_t) * t_z;
    const double q3 =
        seen.R(2, 0) * before.x + seen.R(2, 1) * before.y + seen.R(2, 2) + seen.t(2) * before.chi;
    const double q3ByKappa = -(R(2, 0) * before.x + R(2, 1) * before.y + t3 * before.chi) / (k * k);
    s.C[0][focal_] = (R(0, 2) - after.x * q3ByKappa) / q3;
    s.C[1][focal_] = (R(1, 2) - after.y * q3ByKappa) / q3;
    s.C[2][focal_] = -after.chi * q3ByKappa / q3;
  }
  return s;
}

/// How the twist changes, from the means over two stretches: short ones if the change exceeds its
/// noise there on average, else longer ones, in which slow changes show, else none. Measured noise
/// that passed for a change would pull t_d (errors in variables), as it does with depth; see
/// OdometryNoise::deadBand.
void JointDepthFilter::findAcceleration(const MotionBuffer& odometry, double end_s,
                                        ShiftedMotion& shifted) {
  const Motion& motion = shifted.motion;
  const OdometryNoise& noise = options_.filter.odometry;
  const OdometryNoise::Step step = noise.over(motion);
  const bool isMeasured = noise.mode == OdometryMode::measured;
  const double keep = std::exp(-motion.dt / kChangeMemory_s);
  for (int i = kStretches - 1; i >= 0; --i) {  // the shortest that serves comes last and stays
    const double stretch = kStretch[i] * motion.dt;
    const auto late = odometry.meanTwist(end_s - stretch, end_s);
    const auto early = odometry.meanTwist(end_s - 2 * stretch, end_s - stretch);
    if (early.coverage != Coverage::complete || late.coverage != Coverage::complete) continue;
    const Vector6d a = (stacked(late.twist) - stacked(early.twist)) / stretch;
    const double scale = 6 / (kStretch[i] * motion.dt * motion.dt * stretch * stretch);
    const double expected[2] = {step.variance_t * scale, step.variance_theta * scale};
    for (Eigen::Index k = 0; k < 2; ++k) {
      const auto part = a.segment<3>(3 * k);
      if (!isMeasured || !(expected[k] > 0)) {
        shifted.acceleration.segment<3>(3 * k) = part;
        continue;
      }
      double& change = change_[i][k];
      const double now = std::min(part.squaredNorm() / expected[k], kLargestChange);
      change = change < 0 ? now : keep * change + (1 - keep) * now;
      const bool isReal = change > kChanges, isLongest = i == kStretches - 1;
      if (isReal) shifted.acceleration.segment<3>(3 * k) = part;
      if (isReal || isLongest) shifted.accelerationVariance[k] = kChanges * expected[k] / 3;
    }
  }
}

/// P <- Phi P Phi' + G G', with Phi the identity for the common states: rows first, then, P being
/// symmetric, the rows of the transpose, of which those up to the diagonal will do.
void JointDepthFilter::propagate(const std::array<PointStep, kJointPoints>& steps) {
  const int n = rows();
  const auto applied = [&](const Square& in, Square& out, bool isToDiagonal) {
    for (int i = 0; i < common_; ++i) out[i] = in[i];
    for (int place = 0; place < places_; ++place) {
      const PointStep& s = steps[place];
      const int p = row(place), width = padded(isToDiagonal ? p + 3 : n);
      for (int i = 0; i < 3; ++i) {
        const double a = s.F[i][0], b = s.F[i][1], c = s.F[i][2];
        Row& to = out[p + i];
        for (int j = 0; j < width; ++j) to[j] = a * in[p][j] + b * in[p + 1][j] + c * in[p + 2][j];
        for (int k = 0; k < common_; ++k) {
          const double d = s.C[i][k];
          for (int j = 0; j < width; ++j) to[j] += d * in[k][j];
        }
      }
    }
  };
  Square rowsDone, transposed;
  applied(P_, rowsDone, false);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < padded(n); ++j) transposed[i][j] = j < n ? rowsDone[j][i] : 0;
  }
  applied(transposed, P_, true);

  std::array<Row, 6> G = {};
  for (int place = 0; place < places_; ++place) {
    for (int i = 0; i < 3; ++i) {
      for (int m = 0; m < 6; ++m) G[m][row(place) + i] = steps[place].G[i][m];
    }
  }
  for (int i = common_; i < n; ++i) {
    Row& to = P_[i];
    const double g[] = {G[0][i], G[1][i], G[2][i], G[3][i], G[4][i], G[5][i]};
    for (int j = 0, width = padded(i + 1); j < width; ++j) {
      to[j] += g[0] * G[0][j] + g[1] * G[1][j] + g[2] * G[2][j] + g[3] * G[3][j] + g[4] * G[4][j] +
               g[5] * G[5][j];
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) P_[j][i] = P_[i][j];
  }

  const auto propagated = [&](const Row& e, bool isScale) {
    Row to = e;
    for (int place = 0; place < places_; ++place) {
      const PointStep& s = steps[place];
      const int p = row(place);
      for (int i = 0; i < 3; ++i) {
        const double c = i < 2 && joint_[place] != kNone ? s.parallax[i] : s.F[i][2];
        to[p + i] = s.F[i][0] * e[p] + s.F[i][1] * e[p + 1] + c * e[p + 2];
        for (int k = 0; k < common_; ++k) to[p + i] += s.C[i][k] * e[k];
        if (isScale) to[p + i] += s.scale[i];
      }
    }
    return to;
  };
  if (options_.filter.odometryScaleSigma > 0) scale_ = propagated(scale_, true);
  if (isConsideringFocal()) focalSensitivity_ = propagated(focalSensitivity_, false);
}

// --- Correction

void JointDepthFilter::correct(const std::vector<PointObservation>& observations) {
  for (std::size_t i = 0; i < size_; ++i) ++slots_[i].unseen;
  for (const PointObservation& observation : observations) {
    Slot* slot = findOrAdd(observation.id);
    if (!slot) {
      ++ignored_;
      continue;
    }
    const PointMeasurement& measured = observation.measurement;
    if (!slot->isStarted) {
      if (!measured.isUsable()) continue;
      start(*slot, measured, slot->prior);
      slot->isStarted = true;
    } else if (slot->place != kNone) {
      correctJoint(*slot, measured);
    } else {
      const double scale = 1 / kappa();
      detail::correctPoint(slot->point,
                           {measured.x * scale, measured.y * scale, measured.sigma * scale},
                           options_.filter, range_);
    }
    slot->unseen = 0;
  }
  elect();
}

void JointDepthFilter::start(Slot& slot, const PointMeasurement& measurement,
                             const DepthPrior& prior) {
  const double scale = 1 / kappa();
  detail::resetPoint(slot.point,
                     {measurement.x * scale, measurement.y * scale, measurement.sigma * scale},
                     prior.sanitised(range_));
  if (slot.place != kNone) takePlace(slot);
}

/// Puts the covariance of the point alone at its place, and its state in measured units.
void JointDepthFilter::takePlace(Slot& slot) {
  FilterPoint& point = slot.point;
  const double k = kappa();
  const int p = row(slot.place);
  clearPlace(slot.place);
  const double block[3][3] = {{point.xx, point.xy, point.xc},
                              {point.xy, point.yy, point.yc},
                              {point.xc, point.yc, point.cc}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) P_[p + i][p + j] = k * k * block[i][j];
    scale_[p + i] = k * point.scale[i];
    focalSensitivity_[p + i] = k * point.focal[i];
  }
  point.x *= k;
  point.y *= k;
  point.chi *= k;
}

void JointDepthFilter::addToState(const Row& k, double nu) {
  for (int i = 0; i < common_; ++i) values_[i] += k[i] * nu;
  if (focal_ != kNone) values_[focal_] = std::clamp(values_[focal_], 1 / kFocalRange, kFocalRange);
  for (int place = 0; place < places_; ++place) {
    Slot* slot = slotAt(place);
    if (!slot) continue;
    const int p = row(place);
    slot->point.x += k[p] * nu;
    slot->point.y += k[p + 1] * nu;
    slot->point.chi += k[p + 2] * nu;
  }
}

void JointDepthFilter::correctJoint(Slot& slot, const PointMeasurement& measurement) {
  FilterPoint& point = slot.point;
  if (!measurement.isUsable()) {
    point.phase = Phase::rejected;
    return;
  }
  const InverseDepthFilterOptions& o = options_.filter;
  const int p = row(slot.place), n = rows(), width = padded(n);
  const double r = detail::measurementVariance(measurement.sigma);
  const double x = point.x, y = point.y;
  const Row ux = P_[p], uy = P_[p + 1];
  const double Sxx = ux[p], Sxy = ux[p + 1], Syy = uy[p + 1];
  const double nu_x = measurement.x - x, nu_y = measurement.y - y;

  // Change of the innovation by the considered parameters.
  const double bySx = -scale_[p], bySy = -scale_[p + 1];
  const double byFx = x - focalSensitivity_[p], byFy = y - focalSensitivity_[p + 1];
  const double s2 = o.odometryScaleSigma * o.odometryScaleSigma;
  const double f2 = isConsideringFocal() ? o.focalSigma * o.focalSigma : 0;
  double a = Sxx + r + s2 * bySx * bySx + f2 * byFx * byFx;
  double b = Sxy + s2 * bySx * bySy + f2 * byFx * byFy;
  double c = Syy + r + s2 * bySy * bySy + f2 * byFy * byFy;
  double det = a * c - b * b;
  const double nis = det > 0 ? (c * nu_x * nu_x - 2 * b * nu_x * nu_y + a * nu_y * nu_y) / det
                             : std::numeric_limits<double>::infinity();
  switch (detail::judge(point, nis, o)) {
    case Verdict::restart:
      start(slot, measurement, {1 / range_.clampChi(point.chi / kappa())});
      return;
    case Verdict::reject:
      point.phase = Phase::rejected;
      return;
    case Verdict::use:
      break;
  }
  const double weighted = detail::weighted(r, nis, o);
  a = Sxx + weighted;
  b = Sxy;
  c = Syy + weighted;
  det = a * c - b * b;
  Row kx, ky;
  for (int j = 0; j < width; ++j) {
    kx[j] = (c * ux[j] - b * uy[j]) / det;
    ky[j] = (a * uy[j] - b * ux[j]) / det;
  }
  addToState(kx, nu_x);
  addToState(ky, nu_y);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_[i][i];
    for (int j = 0; j < width; ++j) P_[i][j] -= kx[i] * ux[j] + ky[i] * uy[j];
    P_[i][i] = std::max(P_[i][i], least);
  }
  if (timeOffset_ != kNone) {
    const double limit = kOffsetRange * options_.timeOffsetSigma_s;
    values_[timeOffset_] = std::clamp(values_[timeOffset_], -limit, limit);
  }
  for (int j = 0; s2 > 0 && j < n; ++j) scale_[j] += kx[j] * bySx + ky[j] * bySy;
  for (int j = 0; f2 > 0 && j < n; ++j) focalSensitivity_[j] += kx[j] * byFx + ky[j] * byFy;
  point.r = r;
  point.phase = Phase::measured;
}

void JointDepthFilter::correctDepth(int id, const DepthPrior& measured) {
  const Slot* known = find(id);
  if (!known || !known->isStarted || !measured.isUsable()) return;
  Slot& slot = slots_[static_cast<std::size_t>(known - slots_.data())];
  if (slot.place == kNone) {
    detail::correctPointDepth(slot.point, measured, range_);
    return;
  }
  const int c = row(slot.place) + 2, n = rows();
  const double chi = range_.clampChi(1 / measured.Z);
  const double variance = detail::depthVariance(chi, measured.sigma_chi);
  const double byChi = 1 / kappa(), byKappa = -slot.point.chi * byChi * byChi;
  const auto seen = [&](const Row& e) {
    return byChi * e[c] + (focal_ == kNone ? 0 : byKappa * e[focal_]);
  };
  Row u = {}, k = {};
  for (int j = 0; j < n; ++j) u[j] = seen(P_[j]);
  const double sum = seen(u) + variance;
  if (!(sum > 0)) return;
  for (int j = 0; j < n; ++j) k[j] = u[j] / sum;
  addToState(k, chi - slot.point.chi * byChi);
  for (int i = 0; i < n; ++i) {
    const double least = detail::kLeastShare * P_[i][i];
    for (int j = 0; j < n; ++j) P_[i][j] -= k[i] * u[j];
    P_[i][i] = std::max(P_[i][i], least);
  }
  const double byScale = -seen(scale_), byFocal = -seen(focalSensitivity_);
  for (int j = 0; j < n; ++j) {
    scale_[j] += k[j] * byScale;
    focalSensitivity_[j] += k[j] * byFocal;
  }
}

// --- Which points are joint

void JointDepthFilter::clearPlace(int place) {
  const int p = row(place);
  for (int i = p; i < p + 3; ++i) {
    P_[i].fill(0);
    for (Row& r : P_) r[i] = 0;
    scale_[i] = focalSensitivity_[i] = 0;
  }
}

void JointDepthFilter::join(Slot& slot) {
  const auto place =
      static_cast<int>(std::find(joint_.begin(), joint_.end(), kNone) - joint_.begin());
  slot.place = place;
  joint_[place] = static_cast<int>(&slot - slots_.data());
  places_ = std::max(places_, place + 1);
  takePlace(slot);
}

void JointDepthFilter::leave(Slot& slot) {
  if (slot.place == kNone) return;
  slot.point = described(slot);
  joint_[slot.place] = kNone;
  clearPlace(slot.place);
  slot.place = kNone;
  while (places_ > 0 && joint_[places_ - 1] == kNone) --places_;
}

void JointDepthFilter::elect() {
  const auto relativeSigma = [this](const Slot& slot) {
    const double cc =
        slot.place == kNone ? slot.point.cc : P_[row(slot.place) + 2][row(slot.place) + 2];
    return std::sqrt(cc) / std::max(slot.point.chi, 1 / range_.Z_max);
  };
  const auto isCandidate = [](const Slot& slot) {
    return slot.isStarted && slot.place == kNone && slot.point.phase == Phase::measured;
  };
  // Squared distance in the image to the nearest joint point: points far apart tell more.
  const auto spread = [this](const Slot& slot) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int place = 0; place < places_; ++place) {
      const Slot* other = slotAt(place);
      if (!other) continue;
      const double dx = slot.point.x - other->point.x, dy = slot.point.y - other->point.y;
      nearest = std::min(nearest, dx * dx + dy * dy);
    }
    return nearest;
  };
  const auto isFull = [this] {
    return std::find(joint_.begin(), joint_.end(), kNone) == joint_.end();
  };
  while (!isFull()) {
    Slot* best = nullptr;
    double bestSpread = -1;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!isCandidate(slots_[i])) continue;
      const double s = spread(slots_[i]);
      if (s > bestSpread) {
        best = &slots_[i];
        bestSpread = s;
      }
    }
    if (!best) return;
    join(*best);
  }
  Slot* best = nullptr;
  for (std::size_t i = 0; i < size_; ++i) {
    if (!isCandidate(slots_[i])) continue;
    if (!best || relativeSigma(slots_[i]) < relativeSigma(*best)) best = &slots_[i];
  }
  if (!best) return;
  Slot* worst = slotAt(0);
  const auto badness = [&](const Slot& slot) {
    return slot.unseen > kPatience ? std::numeric_limits<double>::infinity() : relativeSigma(slot);
  };
  for (int place = 1; place < places_; ++place) {
    if (badness(*slotAt(place)) > badness(*worst)) worst = slotAt(place);
  }
  if (relativeSigma(*best) < kBetter * badness(*worst)) {
    leave(*worst);
    join(*best);
  }
}

// --- Reports

FilterPoint JointDepthFilter::described(const Slot& slot) const {
  FilterPoint point = slot.point;
  if (slot.place == kNone) return point;
  const int p = row(slot.place);
  const double scale = 1 / kappa(), scale2 = scale * scale;
  point.x *= scale;
  point.y *= scale;
  point.chi *= scale;
  point.xx = scale2 * P_[p][p];
  point.xy = scale2 * P_[p][p + 1];
  point.xc = scale2 * P_[p][p + 2];
  point.yy = scale2 * P_[p + 1][p + 1];
  point.yc = scale2 * P_[p + 1][p + 2];
  point.cc = scale2 * P_[p + 2][p + 2];
  if (focal_ != kNone) {  // chi = state / kappa
    point.cc += point.chi * scale *
                (point.chi * scale * P_[focal_][focal_] - 2 * scale * P_[p + 2][focal_]);
    point.cc = std::max(point.cc, 0.);
  }
  for (int i = 0; i < 3; ++i) {
    point.scale[i] = scale * scale_[p + i];
    point.focal[i] = scale * focalSensitivity_[p + i];
  }
  return point;
}

DepthEstimate JointDepthFilter::estimate(int id) const {
  const Slot* slot = find(id);
  if (!slot || !slot->isStarted) {
    const DepthPrior prior = (slot ? slot->prior : prior_).sanitised(range_);
    DepthEstimate unset;
    unset.chi = 1 / prior.Z;
    unset.sigma_chi = prior.sigma_chi;
    return unset;
  }
  InverseDepthFilterOptions options = options_.filter;
  if (focal_ != kNone) options.focalSigma = 0;
  DepthEstimate e = detail::describePoint(described(*slot), step_, dt_, options, range_);
  e.x *= kappa();
  e.y *= kappa();
  e.sigma_xy *= kappa();
  return e;
}

JointDepthFilter::Common JointDepthFilter::common(int index, double prior) const {
  if (index == kNone) return {};
  const double sigma = std::sqrt(P_[index][index]);
  return {values_[index], sigma, true, sigma < kObserved * prior};
}

JointDepthFilter::Common JointDepthFilter::timeOffset() const {
  return common(timeOffset_, options_.timeOffsetSigma_s);
}

JointDepthFilter::Common JointDepthFilter::gyroBias(int axis) const {
  return common(bias_ == kNone ? kNone : bias_ + axis, options_.gyroBiasSigma_rad_s);
}

JointDepthFilter::Common JointDepthFilter::focal() const {
  Common kappa = common(focal_, options_.focalSigma);
  if (!kappa.isEstimated) kappa.value = 1;
  return kappa;
}

}  // namespace depthservo
