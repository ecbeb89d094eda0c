#include "depthservo/motion/Motion.h"

#include <cmath>

namespace depthservo {
namespace {

/// Angle [rad] below which the power series is more accurate than the closed form.
constexpr double kSmallAngle = 0.05;

/// The coefficients of I, K, K^2 in exp(K) and in its integral V(K), K the skew matrix of an angle
/// theta: exp = I + a K + b K^2, V = I + b K + c K^2.
struct Rodrigues {
  double a, b, c;
  explicit Rodrigues(double theta2) {
    if (theta2 < kSmallAngle * kSmallAngle) {
      a = 1 - theta2 * (1. / 6 - theta2 * (1. / 120 - theta2 * (1. / 5040)));
      b = 1. / 2 - theta2 * (1. / 24 - theta2 * (1. / 720 - theta2 * (1. / 40320)));
      c = 1. / 6 - theta2 * (1. / 120 - theta2 * (1. / 5040 - theta2 * (1. / 362880)));
    } else {
      const double theta = std::sqrt(theta2);
      a = std::sin(theta) / theta;
      b = (1 - std::cos(theta)) / theta2;
      c = (1 - a) / theta2;
    }
  }
};

}  // namespace

Motion Motion::fromTwist(const Twist& twist, double dt) {
  const double wx = -dt * twist.angular.x(), wy = -dt * twist.angular.y(),
               wz = -dt * twist.angular.z();
  const double vx = -dt * twist.linear.x(), vy = -dt * twist.linear.y(),
               vz = -dt * twist.linear.z();
  const double xx = wx * wx, yy = wy * wy, zz = wz * wz;
  const auto [a, b, c] = Rodrigues(xx + yy + zz);
  // K^2 = w w^T - |w|^2 I and K v = w x v, applied without forming K.
  const double bxy = b * wx * wy, bxz = b * wx * wz, byz = b * wy * wz;
  const double ax = a * wx, ay = a * wy, az = a * wz;
  const double kx = wy * vz - wz * vy, ky = wz * vx - wx * vz, kz = wx * vy - wy * vx;
  Motion motion;
  motion.R << 1 - b * (yy + zz), bxy - az, bxz + ay,  //
      bxy + az, 1 - b * (xx + zz), byz - ax,          //
      bxz - ay, byz + ax, 1 - b * (xx + yy);
  motion.t << vx + b * kx + c * (wy * kz - wz * ky),  //
      vy + b * ky + c * (wz * kx - wx * kz),          //
      vz + b * kz + c * (wx * ky - wy * kx);
  motion.dt = dt;
  motion.dt2 = dt * dt;
  return motion;
}

Motion Motion::fromPoses(const Eigen::Isometry3d& wMc_before, const Eigen::Isometry3d& wMc_now,
                         double dt) {
  Motion motion;
  motion.R = wMc_now.linear().transpose() * wMc_before.linear();
  motion.t = wMc_now.linear().transpose() * (wMc_before.translation() - wMc_now.translation());
  motion.dt = dt;
  motion.dt2 = dt * dt;
  return motion;
}

Motion Motion::notKnown(const UnknownPart& part) {
  Motion motion;
  motion.dt = part.duration_s;
  motion.unknown = part;
  return motion;
}

Motion Motion::then(const Motion& next) const {
  Motion both;
  both.R.noalias() = next.R * R;
  both.t.noalias() = next.R * t;
  both.t += next.t;
  both.dt = dt + next.dt;
  both.dt2 = dt2 + next.dt2;
  both.within = {within.t2 + next.within.t2, within.theta2 + next.within.theta2};
  both.unknown = {unknown.duration_s + next.unknown.duration_s,
                  unknown.distance_m + next.unknown.distance_m,
                  unknown.angle_rad + next.unknown.angle_rad};
  return both;
}

Motion Motion::inverse() const {
  Motion back;
  back.R = R.transpose();
  back.t.noalias() = -(R.transpose() * t);
  back.dt = -dt;
  back.dt2 = dt2;
  back.within = within;
  back.unknown = unknown;
  return back;
}

Twist Motion::twist() const {
  if (dt == 0) return {};
  // (sin theta) axis, and the angle by the axis: theta / sin theta = 1 + s^2/6 + 3 s^4/40 + ...
  const Eigen::Vector3d s(0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)),
                          0.5 * (R(1, 0) - R(0, 1)));
  const double s2 = s.squaredNorm();
  Eigen::Vector3d w;
  if (s2 < kSmallAngle * kSmallAngle && R.trace() > 1) {
    w = (1 + s2 * (1. / 6 + s2 * (3. / 40 + s2 * (5. / 112 + s2 * (35. / 1152))))) * s;
  } else {
    const Eigen::AngleAxisd rotation{Eigen::Quaterniond(R)};
    w = rotation.angle() * rotation.axis();
  }
  // V^-1 = I - K/2 + d K^2 with d = (1 - (theta/2) cot(theta/2)) / theta^2.
  const double theta2 = w.squaredNorm(), theta = std::sqrt(theta2);
  const double d = theta < kSmallAngle ? (1 + theta2 / 60 * (1 + theta2 / 42)) / 12
                                       : (1 - 0.5 * theta / std::tan(0.5 * theta)) / theta2;
  const Eigen::Vector3d w_x_t = w.cross(t);
  const Eigen::Vector3d v = t - 0.5 * w_x_t + d * w.cross(w_x_t);
  return {-v / dt, -w / dt};
}

Twist twistOfCamera(const Eigen::Isometry3d& bMc, const Twist& ofBody) {
  const Eigen::Matrix3d cRb = bMc.linear().transpose();
  const Eigen::Vector3d lever = bMc.translation();
  return {cRb * (ofBody.linear + ofBody.angular.cross(lever)), cRb * ofBody.angular};
}

}  // namespace depthservo
