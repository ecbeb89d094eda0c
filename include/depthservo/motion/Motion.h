#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "depthservo/api.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/motion/UnknownMotion.h"

namespace depthservo {

/// How much a motion may differ from what its odometry says since the twist changed within rows, by
/// mean squares that add up.
struct WithinRows {
  double t2 = 0;      ///< of each component of the translation [m^2]
  double theta2 = 0;  ///< of each component of the rotation [rad^2]
};

/// What the camera's own motion does to a point of a still scene: p_now = R p_before + t.
///
/// R (3x3, a rotation) and t (3, [m]) are the pose of the earlier camera frame in the later one, so
/// for a camera that advances along z, t = (0, 0, -distance). `Motion` is an element of SE(3)
/// together with the time it took; with constant twist (v, w) over dt it is exp(-(v, w) dt), in
/// ViSP's terms `vpExponentialMap::direct(v, dt).inverse()`.
///
/// Real-time: every member is free of allocation and exceptions. Non-finite input gives non-finite
/// output; `isFinite()` tells.
struct DEPTHSERVO_API Motion {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();  ///< [m]
  double dt = 0.0;                              ///< duration [s]
  double dt2 = 0.0;       ///< sum of the squared durations of its odometry rows [s^2]; scales noise
  WithinRows within{};    ///< changes of the twist that its rows do not show
  UnknownPart unknown{};  ///< of dt; the camera stands still in it as far as R and t go

  /// Motion of a camera that keeps the twist for dt [s]: exact exponential, any angle.
  static Motion fromTwist(const Twist& twist, double dt);

  /// Motion between two camera poses in a common (world) frame, dt [s] apart.
  static Motion fromPoses(const Eigen::Isometry3d& wMc_before, const Eigen::Isometry3d& wMc_now,
                          double dt);

  /// A motion of which nothing is known, lasting `part.duration_s`.
  static Motion notKnown(const UnknownPart& part);

  /// This motion, then `next`: p = next.R (R p + t) + next.t. Durations and what
  /// is not known add.
  Motion then(const Motion& next) const;

  /// The motion back: `then(inverse())` is the identity with dt = 0. dt changes sign, dt2 and
  /// what is not known do not.
  Motion inverse() const;

  /// The constant twist that makes this motion in dt (logarithm of SE(3)); unique for rotations
  /// below pi. Zero when dt is 0.
  Twist twist() const;

  bool isFinite() const {
    // No sum hides a NaN or an infinity.
    return std::isfinite((R.col(0) + R.col(1) + R.col(2) + t).sum() + (dt + dt2) +
                         (within.t2 + within.theta2) +
                         (unknown.duration_s + unknown.distance_m + unknown.angle_rad));
  }

  static constexpr double kLongest_s = 1e6;

  /// Whether it can be what happened between two images: finite, lasting 1 ns to kLongest_s, R a
  /// rotation to 1 %, no faster on the mean than ten times the fastest twist, nothing beyond sense.
  bool isUsable() const {
    constexpr double kMost = 1e12, kMostVariance = kMost * kMost;
    return dt >= 1e-9 && dt <= kLongest_s && isFinite() && std::abs(R.squaredNorm() - 3) <= 0.03 &&
           t.norm() <= 10 * Twist::kLargestSpeed_mps * dt && std::abs(dt2) <= kMost &&
           std::abs(within.t2) <= kMostVariance && std::abs(within.theta2) <= kMostVariance &&
           std::abs(unknown.duration_s) <= kLongest_s && std::abs(unknown.distance_m) <= kMost &&
           std::abs(unknown.angle_rad) <= kMost;
  }
};

/// Twist of a camera at the pose bMc = (R, p) in a body with that twist, each in its own frame:
/// v_c = R^T (v + w x p), w_c = R^T w. Both see the same rigid motion.
DEPTHSERVO_API Twist twistOfCamera(const Eigen::Isometry3d& bMc, const Twist& ofBody);

}  // namespace depthservo
