#include "observation/expectedPoints.h"

namespace depthservo {

std::vector<ExpectedPoint> expectedPoints(const PointSetEstimator& estimator,
                                          const std::vector<int>& ids, const MotionBuffer& odometry,
                                          double time_s, const PinholeCamera& camera) {
  std::vector<ExpectedPoint> expected;
  for (const int id : ids) {
    const DepthEstimate estimate = estimator.estimate(id, odometry, time_s);
    if (estimate.status == DepthStatus::unset || estimate.status == DepthStatus::lost) continue;
    const Eigen::Vector2d pixel = camera.toPixel(estimate.x, estimate.y);
    expected.push_back(
        {id, pixel.x(), pixel.y(), estimate.sigma_xy * camera.focal_px(estimate.x, estimate.y)});
  }
  return expected;
}

}  // namespace depthservo
