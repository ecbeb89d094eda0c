#include "observation/makeEstimator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "depthservo/pose/FrameRateConditions.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "depth/EulerObserver.h"

namespace depthservo {
namespace {

/// A window of 20 images then spans two seconds at any frame rate, as in the paper's simulation.
constexpr double kWindowSpacing_s = 0.1;

/// rms sigma of the depths that one image of the target shows [m], from the front at this distance.
/// From there the tilt of a flat target hardly shows, but it moves a point by no more than the
/// point's distance from the middle.
double depthNoiseOfOneImage(const std::vector<Eigen::Vector3d>& points, double distance,
                            double sigma, const DepthRange& range) {
  VisualMotionObserverOptions options;
  options.cMo = Eigen::Isometry3d::Identity();
  options.cMo->translation().z() = distance;
  VisualMotionObserver observer(points, options, range);
  std::vector<PointObservation> image;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d cP = *options.cMo * points[i];
    image.push_back({static_cast<int>(i), {cP.x() / cP.z(), cP.y() / cP.z(), sigma}});
  }
  observer.correct(image);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) middle += point / static_cast<double>(points.size());
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double sigma_Z =
        std::min(observer.estimate(static_cast<int>(i)).sigma_Z(), (points[i] - middle).norm());
    sum += sigma_Z * sigma_Z;
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

}  // namespace

std::optional<SharedErrorFilterOptions> sharedErrorsOf(const EstimatorSetup& setup) {
  if (!setup.errors) return std::nullopt;
  SharedErrorFilterOptions options;
  options.errors = *setup.errors;
  options.focal_px = setup.camera.focal_px();
  options.rowScale = setup.camera.fy / setup.camera.height;
  options.rowOffset = setup.camera.cy / setup.camera.height;
  return options;
}

double observerGain(const EstimatorSetup& setup) {
  const KnownTargetOptions& pose = setup.depth.pose;
  if (pose.ke) return *pose.ke;
  const double sigma_Z = depthNoiseOfOneImage(setup.target.points, setup.depth.initial, setup.sigma,
                                              setup.depth.range());
  return likelyObserverGain(setup.frameRate, pose.kappa, sigma_Z);
}

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
  filter.focalSigma = setup.focalSigma;
  switch (setup.depth.estimator) {
    case EstimatorKind::constant:
    case EstimatorKind::trueDepth:
      return pointwise(ConstantDepth(range));
    case EstimatorKind::twoFrame:
      return pointwise(TwoFrameLeastSquares(range));
    case EstimatorKind::nonlinear: {
      if (setup.depth.euler) return pointwise(EulerObserver(setup.depth.gains.observer(), range));
      NonlinearObserverOptions options;
      options.gains = setup.depth.gains.observer();
      options.odometry = setup.odometry;
      if (setup.depth.object) {
        return std::make_unique<ObjectDepthObserver>(capacity, options, prior, range);
      }
      return pointwise(NonlinearDepthObserver(options, range));
    }
    case EstimatorKind::window: {
      WindowOptions options;
      options.spacing_s = kWindowSpacing_s;
      return pointwise(WindowDepthEstimator(options, range));
    }
    case EstimatorKind::filter:
      if (const auto errors = sharedErrorsOf(setup)) {
        const SharedErrorFilter one(1, *errors, prior, range);
        return std::make_unique<SeparatePoints>(one, capacity, prior);
      }
      return pointwise(InverseDepthFilter(filter, range));
    case EstimatorKind::joint: {
      if (const auto errors = sharedErrorsOf(setup)) {
        return std::make_unique<SharedErrorFilter>(capacity, *errors, prior, range);
      }
      JointDepthFilterOptions options;
      options.filter = filter;
      options.estimateTimeOffset = setup.depth.joint.time_offset;
      options.estimateGyroBias = setup.depth.joint.gyro_bias;
      options.estimateFocal = setup.depth.joint.focal;
      return std::make_unique<JointDepthFilter>(capacity, options, prior, range);
    }
    case EstimatorKind::pose: {
      VisualMotionObserverOptions options;
      options.ke = observerGain(setup);
      using LostFrames = VisualMotionObserverOptions::LostFrames;
      options.lostFrames = setup.depth.pose.guard ? LostFrames::guarded : LostFrames::unguarded;
      options.coupledGoal = setup.depth.pose.coupledGoal;
      options.couplingStep_s = setup.depth.pose.couplingStep_s;
      return std::make_unique<KnownTargetEstimator>(setup.target.points, options, range);
    }
  }
  throw std::logic_error("not an estimator");
}

std::optional<JointStates> jointStatesOf(const PointSetEstimator& estimator) {
  if (const auto* shared = dynamic_cast<const SharedErrorFilter*>(&estimator)) {
    const auto common = [](const SharedErrorFilter::Shared& state, double offset) {
      constexpr double kObserved = 0.25;
      const bool isEstimated = state.prior > 0, isCalibrated = state.expected != 0;
      const bool isObserved = isCalibrated || state.sigma < kObserved * state.prior;
      return JointDepthFilter::Common{state.value + offset, state.sigma, isEstimated,
                                      isEstimated && isObserved};
    };
    return JointStates{common(shared->latency(), 0),
                       {common(shared->gyroBias(0), 0), common(shared->gyroBias(1), 0),
                        common(shared->gyroBias(2), 0)},
                       common(shared->focal(), 1)};
  }
  const auto* joint = dynamic_cast<const JointDepthFilter*>(&estimator);
  if (!joint) return std::nullopt;
  return JointStates{joint->timeOffset(),
                     {joint->gyroBias(0), joint->gyroBias(1), joint->gyroBias(2)},
                     joint->focal()};
}

}  // namespace depthservo
