#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/motion/OdometryNoise.h"
#include "depthservo/observation/EstimatorOptions.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/target/DotTarget.h"

namespace depthservo {

/// What an estimator is made from, worked out of its options and what it observes.
struct EstimatorSetup {
  EstimatorOptions depth;         ///< which one, its first guess and its range
  OdometryNoise odometry;         ///< as declared
  double odometryScaleSigma = 0;  ///< relative, 1 sigma
  DotTarget target;               ///< for `pose`
  double frameRate = 30;          ///< images per second [Hz]; for the gain of `pose`
  double sigma = 1e-3;            ///< noise of a point, 1 sigma per axis, normalised; likewise
  double focalSigma = 0;          ///< of the focal length, relative, 1 sigma
  std::optional<ErrorProfile> errors =
      {};  ///< of the robot; none: white noise and the sigmas above
  PinholeCamera camera = {};
};

/// The gain ke of `pose` [1/s]: as set, else that with the least lag and noise of the depths at
/// this frame rate, for the target as seen from the front at the first guess of its distance.
DEPTHSERVO_INNER double observerGain(const EstimatorSetup& setup);

/// The estimator a user chose, for up to `capacity` points. (`true` is a constant depth that is
/// told the truth in every frame.)
DEPTHSERVO_INNER std::unique_ptr<PointSetEstimator> makeEstimator(const EstimatorSetup& setup,
                                                                  std::size_t capacity);

/// For a filter that learns the robot's errors; none: they are taken for white noise.
std::optional<SharedErrorFilterOptions> sharedErrorsOf(const EstimatorSetup& setup);

/// What a joint filter has learnt besides depths; nothing of another estimator.
DEPTHSERVO_INNER std::optional<JointStates> jointStatesOf(const PointSetEstimator& estimator);

}  // namespace depthservo
