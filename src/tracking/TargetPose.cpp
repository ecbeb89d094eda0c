#include "depthservo/tracking/TargetPose.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

namespace depthservo {
namespace {

struct Seen {
  std::vector<cv::Point3d> object;  // [m]
  std::vector<cv::Point2d> image;   // normalised
};

struct Pose {
  cv::Mat rotation, translation;  // of the plate in the camera, rotation as a vector
};

Pose poseOf(const Eigen::Isometry3d& cMo) {
  const Eigen::AngleAxisd turn(cMo.linear());
  const Eigen::Vector3d r = turn.angle() * turn.axis(), t = cMo.translation();
  return {(cv::Mat_<double>(3, 1) << r.x(), r.y(), r.z()),
          (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z())};
}

Eigen::Isometry3d transform(const Pose& pose) {
  const Eigen::Map<const Eigen::Vector3d> r(pose.rotation.ptr<double>()),
      t(pose.translation.ptr<double>());
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) cMo.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  cMo.translation() = t;
  return cMo;
}

/// The best of the poses that the points show; throws cv::Exception when they show none.
Pose firstPose(const Seen& seen) {
  const double z = seen.object.front().z;
  const bool isFlat = std::all_of(seen.object.begin(), seen.object.end(),
                                  [z](const cv::Point3d& p) { return p.z == z; });
  Pose pose;
  cv::solvePnP(seen.object, seen.image, cv::Matx33d::eye(), cv::noArray(), pose.rotation,
               pose.translation, false, isFlat ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP);
  return pose;
}

}  // namespace

std::optional<TargetPose::Result> TargetPose::compute(const std::vector<TrackedPoint>& points) {
  Seen seen;
  std::vector<TrackedPoint> tracked;
  for (const TrackedPoint& point : points) {
    if (point.id < 0 || static_cast<std::size_t>(point.id) >= target_.points.size()) continue;
    const Eigen::Vector3d& P = target_.points[static_cast<std::size_t>(point.id)];
    const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
    seen.object.emplace_back(P.x(), P.y(), P.z());
    seen.image.emplace_back(s.x(), s.y());
    tracked.push_back(point);
  }
  if (tracked.size() < 4) return std::nullopt;
  Eigen::Isometry3d found;
  try {
    Pose pose = previous_ ? poseOf(*previous_) : firstPose(seen);
    constexpr int kMostSteps = 200;
    constexpr double kStandstill = 1e-14;  // of the residual
    cv::solvePnPRefineVVS(
        seen.object, seen.image, cv::Matx33d::eye(), cv::noArray(), pose.rotation, pose.translation,
        {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, kMostSteps, kStandstill});
    found = transform(pose);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  double squared_px = 0;
  for (const TrackedPoint& point : tracked) {
    const Eigen::Vector3d cP = found * target_.points[static_cast<std::size_t>(point.id)];
    if (!(cP.z() > 0)) return std::nullopt;
    const Eigen::Vector2d pixel = camera_.toPixel(cP.x() / cP.z(), cP.y() / cP.z());
    squared_px += (pixel - Eigen::Vector2d(point.u, point.v)).squaredNorm();
  }
  if (!std::isfinite(squared_px)) return std::nullopt;
  previous_ = found;
  return Result{found, std::sqrt(squared_px / static_cast<double>(tracked.size()))};
}

}  // namespace depthservo
