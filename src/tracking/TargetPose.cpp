#include "depthservo/tracking/TargetPose.h"

#include <visp3/core/vpException.h>
#include <visp3/vision/vpPose.h>

#include <cmath>

#include "visp/pose.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {

std::optional<TargetPose::Result> TargetPose::compute(const std::vector<TrackedPoint>& points) {
  std::vector<TrackedPoint> seen;
  vpPose pose;
  for (const TrackedPoint& point : points) {
    if (point.id < 0 || static_cast<std::size_t>(point.id) >= target_.points.size()) continue;
    const Eigen::Vector3d& P = target_.points[static_cast<std::size_t>(point.id)];
    const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
    vpPoint visp(P.x(), P.y(), P.z());
    visp.set_x(s.x());
    visp.set_y(s.y());
    pose.addPoint(visp);
    seen.push_back(point);
  }
  if (seen.size() < 4) return std::nullopt;
  vpHomogeneousMatrix cMo;
  try {
    if (previous_) {
      cMo = toVisp(*previous_);
      pose.computePose(vpPose::VIRTUAL_VS, cMo);
    } else {
      pose.computePose(vpPose::DEMENTHON_VIRTUAL_VS, cMo);
    }
  } catch (const vpException&) {
    return std::nullopt;
  }
  const Eigen::Isometry3d found = fromVisp(cMo);
  double squared_px = 0;
  for (const TrackedPoint& point : seen) {
    const Eigen::Vector3d cP = found * target_.points[static_cast<std::size_t>(point.id)];
    if (!(cP.z() > 0)) return std::nullopt;
    const Eigen::Vector2d pixel = camera_.toPixel(cP.x() / cP.z(), cP.y() / cP.z());
    squared_px += (pixel - Eigen::Vector2d(point.u, point.v)).squaredNorm();
  }
  if (!std::isfinite(squared_px)) return std::nullopt;
  previous_ = found;
  return Result{found, std::sqrt(squared_px / static_cast<double>(seen.size()))};
}

}  // namespace depthservo
