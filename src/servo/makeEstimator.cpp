#include "servo/makeEstimator.h"

#include <stdexcept>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"

namespace depthservo {

std::unique_ptr<PointSetEstimator> makeEstimator(const Scenario::Depth& depth,
                                                 const Eigen::Vector2d& odometryNoise,
                                                 std::size_t capacity) {
  const DepthRange range = depth.range();
  const auto pointwise = [&](const DepthEstimator& estimator) {
    return std::make_unique<PointwiseEstimator>(estimator, capacity, DepthPrior{depth.initial},
                                                range);
  };
  switch (depth.estimator) {
    case EstimatorKind::constant:
    case EstimatorKind::trueDepth:
      return pointwise(ConstantDepth(range));
    case EstimatorKind::nonlinear: {
      NonlinearObserverOptions options;
      options.gains = depth.gains.observer();
      options.sigma_v = odometryNoise[0];
      options.sigma_w = odometryNoise[1];
      return pointwise(NonlinearDepthObserver(options, range));
    }
    default:
      throw std::logic_error("estimator not in this version: refused when it was read");
  }
}

}  // namespace depthservo
