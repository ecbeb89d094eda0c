#include "depthservo/tracking/TargetPose.h"

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace depthservo {
namespace {

/// Points of a target and where they are seen, normalised.
struct Correspondences {
  std::vector<cv::Point3d> target;
  std::vector<cv::Point2d> seen;
};

/// The pose of least reprojection error: from `start` on, or from a closed form (SQPnP) without.
std::optional<Eigen::Isometry3d> solved(const Correspondences& points,
                                        const std::optional<Eigen::Isometry3d>& start) {
  static const cv::TermCriteria kConverged(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 200,
                                           1e-14);
  const cv::Matx33d normalised = cv::Matx33d::eye();
  cv::Vec3d rotation, translation;
  if (start) {
    const Eigen::AngleAxisd turn(start->linear());
    const Eigen::Vector3d r = turn.angle() * turn.axis(), t = start->translation();
    rotation = {r.x(), r.y(), r.z()};
    translation = {t.x(), t.y(), t.z()};
  } else if (!cv::solvePnP(points.target, points.seen, normalised, {}, rotation, translation, false,
                           cv::SOLVEPNP_SQPNP)) {
    return std::nullopt;
  }
  cv::solvePnPRefineVVS(points.target, points.seen, normalised, {}, rotation, translation,
                        kConverged, 1);
  const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) pose.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  pose.translation() << translation[0], translation[1], translation[2];
  return pose;
}

}  // namespace

std::optional<TargetPose::Result> TargetPose::compute(const std::vector<TrackedPoint>& points) {
  std::vector<TrackedPoint> seen;
  Correspondences pairs;
  for (const TrackedPoint& point : points) {
    if (point.id < 0 || static_cast<std::size_t>(point.id) >= target_.points.size()) continue;
    const Eigen::Vector3d& P = target_.points[static_cast<std::size_t>(point.id)];
    const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
    pairs.target.emplace_back(P.x(), P.y(), P.z());
    pairs.seen.emplace_back(s.x(), s.y());
    seen.push_back(point);
  }
  if (seen.size() < 4) return std::nullopt;
  std::optional<Eigen::Isometry3d> found;
  try {
    found = solved(pairs, previous_);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  if (!found) return std::nullopt;
  double squared_px = 0;
  for (const TrackedPoint& point : seen) {
    const Eigen::Vector3d cP = *found * target_.points[static_cast<std::size_t>(point.id)];
    if (!(cP.z() > 0)) return std::nullopt;
    const Eigen::Vector2d pixel = camera_.toPixel(cP.x() / cP.z(), cP.y() / cP.z());
    squared_px += (pixel - Eigen::Vector2d(point.u, point.v)).squaredNorm();
  }
  if (!std::isfinite(squared_px)) return std::nullopt;
  previous_ = found;
  return Result{*found, std::sqrt(squared_px / static_cast<double>(seen.size()))};
}

}  // namespace depthservo
