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
  const Eigen::Vector3d w = -dt * twist.angular;
  const Eigen::Vector3d v = -dt * twist.linear;
  const Rodrigues k(w.squaredNorm());
  // K^2 = w w^T - |w|^2 I, applied without forming K.
  const Eigen::Vector3d aw = k.a * w, bw = k.b * w;
  const double diagonal = 1 - bw.dot(w);
  const double xy = bw.x() * w.y(), xz = bw.x() * w.z(), yz = bw.y() * w.z();
  const Eigen::Vector3d w_x_v = w.cross(v);
  Motion motion;
  motion.R << diagonal + bw.x() * w.x(), xy - aw.z(), xz + aw.y(),  //
      xy + aw.z(), diagonal + bw.y() * w.y(), yz - aw.x(),          //
      xz - aw.y(), yz + aw.x(), diagonal + bw.z() * w.z();
  motion.t = v + k.b * w_x_v + k.c * w.cross(w_x_v);
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

Motion Motion::then(const Motion& next) const {
  Motion both;
  both.R.noalias() = next.R * R;
  both.t.noalias() = next.R * t;
  both.t += next.t;
  both.dt = dt + next.dt;
  both.dt2 = dt2 + next.dt2;
  return both;
}

Motion Motion::inverse() const {
  Motion back;
  back.R = R.transpose();
  back.t.noalias() = -(R.transpose() * t);
  back.dt = -dt;
  back.dt2 = dt2;
  return back;
}

Twist Motion::twist() const {
  if (dt == 0) return {};
  const Eigen::AngleAxisd rotation{Eigen::Quaterniond(R)};
  const double theta = rotation.angle();
  const Eigen::Vector3d w = theta * rotation.axis();
  // V^-1 = I - K/2 + d K^2 with d = (1 - (theta/2) cot(theta/2)) / theta^2.
  const double theta2 = theta * theta;
  const double d = theta < kSmallAngle ? (1 + theta2 / 60 * (1 + theta2 / 42)) / 12
                                       : (1 - 0.5 * theta / std::tan(0.5 * theta)) / theta2;
  const Eigen::Vector3d w_x_t = w.cross(t);
  const Eigen::Vector3d v = t - 0.5 * w_x_t + d * w.cross(w_x_t);
  return {-v / dt, -w / dt};
}

}  // namespace depthservo
