#include "servo/makeEstimator.h"

#include <stdexcept>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"

namespace depthservo {
namespace {

/// A window of 20 images then spans two seconds at any frame rate, as in the paper's simulation.
constexpr double kWindowSpacing_s = 0.1;

}  // namespace

std::unique_ptr<PointSetEstimator> makeEstimator(const EstimatorSetup& setup,
                                                 std::size_t capacity) {
  const DepthRange range = setup.depth.range();
  const DepthPrior prior{setup.depth.initial};
  const auto pointwise = [&](const DepthEstimator& estimator) {
    return std::make_unique<PointwiseEstimator>(estimator, capacity, prior, range);
  };
  InverseDepthFilterOptions filter;
  filter.odometry = setup.odometry;
  filter.odometryScaleSigma = setup.odometryScaleSigma;
  switch (setup.depth.estimator) {
    case EstimatorKind::constant:
    case EstimatorKind::trueDepth:
      return pointwise(ConstantDepth(range));
    case EstimatorKind::twoFrame:
      return pointwise(TwoFrameLeastSquares(range));
    case EstimatorKind::nonlinear: {
      NonlinearObserverOptions options;
      options.gains = setup.depth.gains.observer();
      options.odometry = setup.odometry;
      if (setup.depth.object) {
        return std::make_unique<ObjectDepthObserver>(capacity, options, prior, range);
      }
      return pointwise(NonlinearDepthObserver(options, range));
    }
    case EstimatorKind::window:
      return pointwise(WindowDepthEstimator({}, range));
    case EstimatorKind::filter:
      return pointwise(InverseDepthFilter(filter, range));
    case EstimatorKind::joint: {
      JointDepthFilterOptions options;
      options.filter = filter;
      return std::make_unique<JointDepthFilter>(capacity, options, prior, range);
    }
    case EstimatorKind::pose:
      break;
  }
  throw std::logic_error("estimator not in this version: refused when it was read");
}

}  // namespace depthservo
