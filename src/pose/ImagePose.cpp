#include "pose/ImagePose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace depthservo::detail {
namespace {

/// Reciprocal condition of the image Jacobian (translation over distance, rotation times size)
/// below which its rank counts as less than six.
constexpr double kLeastReciprocalCondition = 1e-5;

/// The iterated method: steps, change [m, rad] at which it has converged, longest turn in a step.
constexpr int kIterations = 10;
constexpr double kConverged = 1e-10;
constexpr double kUnchanged = 1e-6;  // relative to the distance: rounding, not divergence
constexpr double kLongestTurn_rad = 1;

/// rms image error (normalised) of a pose that still explains the points, or so many sigma.
constexpr double kLargestResidual = 0.02;
constexpr double kResidualSigmas = 5;

double squared(double x) { return x * x; }

/// Angle of the rotation [rad], 0 to pi.
double angleOf(const Eigen::Isometry3d& g) {
  return std::atan2(poseError(g).tail<3>().norm(), 0.5 * (g.linear().trace() - 1));
}

}  // namespace

ImagePose::ImagePose(const std::vector<Eigen::Vector3d>& points, const std::vector<SeenPoint>& seen,
                     double size, double Z_min)
    : points_(points),
      seen_(seen),
      count_(static_cast<double>(
          std::count_if(seen.begin(), seen.end(), [](const SeenPoint& s) { return s.isSeen; }))),
      size_(size),
      Z_min_(Z_min) {}

Eigen::Isometry3d ImagePose::facing(double distance) const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), ray = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!seen_[i].isSeen) continue;
    point += points_[i] / count_;
    ray += Eigen::Vector3d(seen_[i].point.x, seen_[i].point.y, 1) / count_;
  }
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
  cMo.translation() = std::max(distance, 2 * size_) * ray - point;
  return cMo;
}

PoseStep ImagePose::step(const Eigen::Isometry3d& cMo, ImageErrorMethod method) const {
  PoseStep step;
  Matrix6d JtJ = Matrix6d::Zero(), JtRJ = Matrix6d::Zero();
  Vector6d Jtf = Vector6d::Zero();
  double ff = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!seen_[i].isSeen) continue;
    const PointMeasurement& f = seen_[i].point;
    const Eigen::Vector3d cP = cMo * points_[i];
    if (!(cP.z() >= Z_min_)) {
      step.verdict = ImageVerdict::behindCamera;
      return step;
    }
    const double chi = 1 / cP.z();
    const Eigen::Vector2d predicted = chi * cP.head<2>();
    const Eigen::Vector2d bracket =
        method == ImageErrorMethod::taylor ? predicted : Eigen::Vector2d(f.x, f.y);
    const Eigen::Vector2d f_e = Eigen::Vector2d(f.x, f.y) - predicted;
    // Rotations are counted in lengths, times size_, so that the condition has no unit.
    Eigen::Matrix<double, 6, 2> Jt;
    const Eigen::Matrix3d R = chi * cMo.linear();
    for (int axis = 0; axis < 2; ++axis) {
      Jt.col(axis) = byPoseError((R.row(axis) - bracket(axis) * R.row(2)).transpose(), points_[i]);
    }
    Jt.bottomRows<3>() /= size_;
    const Matrix6d square = Jt * Jt.transpose();
    JtJ += square;
    JtRJ += squared(f.sigma) * square;
    Jtf += Jt * f_e;
    ff += f_e.squaredNorm();
  }
  const Eigen::LLT<Matrix6d> factor(JtJ);
  const Matrix6d inverse = factor.solve(Matrix6d::Identity());
  const double condition2 = JtJ.norm() * inverse.norm();
  step.error = inverse * Jtf;
  step.residual = std::sqrt(std::max(0.0, ff - step.error.dot(Jtf)) / count_);
  step.covariance = inverse * JtRJ * inverse;
  const bool isRegular =
      factor.info() == Eigen::Success && condition2 * squared(kLeastReciprocalCondition) < 1;
  const double distance2 = cMo.translation().squaredNorm() + squared(size_);
  const bool isTold = step.covariance.topLeftCorner<3, 3>().trace() < distance2 &&
                      step.covariance.bottomRightCorner<3, 3>().trace() < squared(size_);
  if (!isRegular || !isTold || !step.error.allFinite()) step.verdict = ImageVerdict::degenerate;
  step.error.tail<3>() /= size_;
  step.covariance.bottomRows<3>() /= size_;
  step.covariance.rightCols<3>() /= size_;
  return step;
}

PoseStep ImagePose::iterated(const Eigen::Isometry3d& cMo) const {
  PoseStep result;
  Eigen::Isometry3d shown = cMo;
  double change = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kIterations && change > kConverged; ++i) {
    result = step(shown, ImageErrorMethod::mixed);
    if (result.verdict != ImageVerdict::accepted) {
      if (i > 0) result.verdict = ImageVerdict::inconsistent;
      return result;
    }
    change = result.error.norm();
    Eigen::Vector3d turn = result.error.tail<3>();
    turn *= std::min(1.0, kLongestTurn_rad / std::max(turn.norm(), 1e-300));
    shown.translation() += shown.linear() * result.error.head<3>();
    shown.linear() *= Motion::fromTwist({Eigen::Vector3d::Zero(), turn}, -1).R;
  }
  orthonormalise(shown);
  const Eigen::Isometry3d g_ee = cMo.inverse() * shown;
  const bool hasConverged = change < kUnchanged * (1 + shown.translation().norm());
  if (!hasConverged || !explains(result)) {
    result.verdict = ImageVerdict::inconsistent;
  } else if (angleOf(g_ee) > VisualMotionObserver::kLargestRotation) {
    result.verdict = ImageVerdict::rotationTooLarge;
  }
  result.error = poseError(g_ee);
  result.shown = shown;
  return result;
}

bool ImagePose::explains(const PoseStep& step) const {
  double sigma = 0;
  for (const SeenPoint& s : seen_) {
    if (s.isSeen) sigma = std::max(sigma, s.point.sigma);
  }
  return step.residual < std::max(kLargestResidual, kResidualSigmas * sigma);
}

}  // namespace depthservo::detail
