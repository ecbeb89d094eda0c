#include "observation/featureRecord.h"

#include <algorithm>

namespace depthservo {

FeatureRecord featureRecord(int id, const DepthEstimate& estimate,
                            const std::vector<TrackedPoint>& points, const PinholeCamera& camera,
                            const SelfDiagnosis* diagnosis) {
  FeatureRecord record;
  record.id = id;
  record.estimate = estimate;
  const auto point = std::find_if(points.begin(), points.end(),
                                  [id](const TrackedPoint& found) { return found.id == id; });
  record.measured = point != points.end();
  if (record.measured) {
    record.u = point->u;
    record.v = point->v;
    record.sigma_px = point->sigma_px;
  } else {
    const Eigen::Vector2d pixel = camera.toPixel(estimate.x, estimate.y);
    record.u = pixel.x();
    record.v = pixel.y();
  }
  if (diagnosis) record.frames_to_5pct = diagnosis->framesTo5Percent(estimate);
  return record;
}

}  // namespace depthservo
