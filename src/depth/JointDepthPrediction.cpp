#include <algorithm>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/motionOfExposures.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "motion/rateByTwist.h"

/// JointDepthFilter: what the odometry does to the state.
namespace depthservo {
namespace {

using Phase = detail::FilterPoint::Phase;

/// Stretches of odometry whose means tell how the twist changes, in image periods.
constexpr double kStretch[] = {1, 2, 5};

/// The twist changes when its change, squared, is on average over this time so many times what
/// noise alone would give. Single changes count up to a limit, so as to be forgotten in time.
constexpr double kChangeMemory_s = 0.5, kChanges = 3, kLargestChange = 1000;

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
  const auto exposures = detail::motionOfExposures(odometry, t0_s, t1_s, wanted);
  shifted.motion = exposures.motion;
  shifted.missing_s = exposures.missing_s;
  if (timeOffset_ != kNone && shifted.motion.dt > 0) {
    findAcceleration(odometry, t1_s - exposures.offset_s, shifted);
  }
  if (bias_ != kNone) {
    detail::takeOutBias(shifted.motion, {values_[bias_], values_[bias_ + 1], values_[bias_ + 2]});
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
  const bool isSane =
      step_.variance_t + step_.variance_theta < detail::kLargestState &&
      shifted.acceleration.squaredNorm() < detail::kLargestState * detail::kLargestState;
  std::array<PointStep, kJointPoints> steps;
  for (std::size_t i = 0; i < size_; ++i) {
    Slot& slot = slots_[i];
    if (slot.place == kNone) {
      detail::predictPoint(slot.point, step, options_.filter);
      continue;
    }
    const auto [after, isAhead] = flow(seen, {slot.point.x, slot.point.y, slot.point.chi});
    if (!isSane || !isAhead ||
        !(std::abs(after.x) + std::abs(after.y) + std::abs(after.chi) < detail::kLargestState)) {
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
    const Vector6d a = (late.twist.vector() - early.twist.vector()) / stretch;
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
      const int p = row(place), width = detail::padded(isToDiagonal ? p + 3 : n);
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
    for (int j = 0; j < detail::padded(n); ++j) transposed[i][j] = j < n ? rowsDone[j][i] : 0;
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
    for (int j = 0, width = detail::padded(i + 1); j < width; ++j) {
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

}  // namespace depthservo
