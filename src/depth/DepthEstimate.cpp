#include "depthservo/depth/DepthEstimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

namespace depthservo {

const char* toString(DepthStatus status) {
  switch (status) {
    case DepthStatus::unset:
      return "unset";
    case DepthStatus::converging:
      return "converging";
    case DepthStatus::valid:
      return "valid";
    case DepthStatus::unexcited:
      return "unexcited";
    case DepthStatus::coasting:
      return "coasting";
    case DepthStatus::rejected:
      return "rejected";
    case DepthStatus::lost:
      return "lost";
  }
  return "";
}

std::ostream& operator<<(std::ostream& out, DepthStatus status) { return out << toString(status); }

bool DepthPrior::isUsable() const {
  return Z > 0 && std::isfinite(Z) && sigma_chi >= 0 && std::isfinite(sigma_chi);
}

DepthPrior DepthPrior::sanitised(const DepthRange& range) const {
  DepthPrior usable;
  const bool isDepth = Z > 0 && std::isfinite(Z);
  usable.Z = std::clamp(isDepth ? Z : 1.0, range.Z_min, range.Z_max);
  const bool isSigma = sigma_chi > 0 && std::isfinite(sigma_chi);
  usable.sigma_chi = std::min(isSigma ? sigma_chi : kWideSigma_chi, kLargestSigma_chi);
  return usable;
}

DepthEstimate::Interval DepthEstimate::interval() const {
  const double nearest = chi + 2 * sigma_chi, farthest = chi - 2 * sigma_chi;
  return {1 / nearest, farthest > 0 ? 1 / farthest : std::numeric_limits<double>::infinity()};
}

PointSigmas widened(const PointSigmas& sigmas, const PointState& point,
                    const UnknownPart& unknown) {
  constexpr double kSigmasOfBound = 2;
  const double distance = std::max(unknown.distance_m, 0.), angle = std::max(unknown.angle_rad, 0.);
  const double chi = std::max(point.chi, 0.), r2 = point.x * point.x + point.y * point.y;
  const double near = chi + kSigmasOfBound * sigmas.chi;
  const double widest = std::max({DepthPrior::kWideSigma_chi, chi, sigmas.chi});
  double sigma_chi = widest;
  if (near * distance < 1) {
    const double nearest = near / (1 - near * distance) + angle * std::sqrt(r2) * chi;
    sigma_chi = std::min((nearest - chi) / kSigmasOfBound, widest);
  }
  const double across = std::sqrt(1 + r2) * (distance * near + angle * std::sqrt(1 + r2));
  return {std::min(sigmas.xy + across / kSigmasOfBound, PointMeasurement::kLargestSigma),
          std::max(sigma_chi, sigmas.chi)};
}

DepthEstimate predicted(const DepthEstimate& estimate, const Motion& motion,
                        const DepthRange& range) {
  const PointState before{estimate.x, estimate.y, estimate.chi};
  const Flow after = flow(motion, before);
  DepthEstimate result = estimate;
  const Eigen::Vector3d J_point_chi = flowJacobian(motion, before, after.point).col(2);
  if (!after.ahead || !J_point_chi.allFinite()) {
    result.status = DepthStatus::lost;
    return result;
  }
  result.x = after.point.x;
  result.y = after.point.y;
  result.chi = range.clampChi(after.point.chi);
  result.sigma_xy = std::min(estimate.sigma_xy + J_point_chi.head<2>().norm() * estimate.sigma_chi,
                             PointMeasurement::kLargestSigma);
  result.sigma_chi =
      std::min(estimate.sigma_chi * std::abs(J_point_chi.z()), DepthPrior::kLargestSigma_chi);
  if (motion.unknown.exists()) {
    const PointState now{result.x, result.y, result.chi};
    const PointSigmas wide = widened({result.sigma_xy, result.sigma_chi}, now, motion.unknown);
    result.sigma_xy = wide.xy;
    result.sigma_chi = wide.chi;
    result.status = whileMotionIsUnknown(result.status);
  }
  return result;
}

}  // namespace depthservo
