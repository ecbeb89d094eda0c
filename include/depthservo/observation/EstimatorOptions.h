#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/Refuse.h"

namespace depthservo {

/// Every depth estimator by the name users give it: constant | true | two-frame | nonlinear |
/// window | filter | joint | pose.
enum class EstimatorKind { constant, trueDepth, twoFrame, nonlinear, window, filter, joint, pose };
DEPTHSERVO_API const char* toString(EstimatorKind kind);

/// The estimator of this name. Throws InputError at `place`.
DEPTHSERVO_API EstimatorKind estimatorNamed(const std::string& name,
                                            const InputError::Place& place);

/// Gains of the nonlinear observer: k and k_3 if given, otherwise scheduled by settling and
/// W_min.
struct DEPTHSERVO_API ObserverGainOptions {
  double settling = 1.5;         ///< to 2 % [s]
  double W_min = 0.01;           ///< excitation below which the gain stops growing [m/s]
  std::optional<double> k, k_3;  ///< [1/s] and [1/m^2], normalised image coordinates

  ObserverGains observer() const;
};

/// Of the estimator `pose`.
struct KnownTargetOptions {
  std::optional<double> ke;  ///< gain [1/s]; none: designed for the frame rate and `kappa`
  double kappa = 0.1;        ///< how fast the target may move [m/s, rad/s]
  bool guard = true;         ///< end the correction by an image once it is complete
  /// Of the coupled regulation (Ibuki et al. 2023): pose of the target in the camera at the goal,
  /// its odometry step [s], and the gain of the law [1/s].
  std::optional<Eigen::Isometry3d> coupledGoal = {};
  double couplingStep_s = 0.005;
  std::optional<double> kc = {};
};

/// What the joint filter learns besides depths; see JointDepthFilter.
struct JointStateOptions {
  bool time_offset = true, gyro_bias = false, focal = false;
};

/// What an estimator is told of the robot's errors: an ErrorProfile by its name, or white noise
/// alone.
enum class ErrorKind {
  automatic,  ///< declared where odometry noise is; else poses where the motion is from poses or a
              ///< target; else typical
  declared,   ///< what the options declare: white noise and uncertainties that are considered
  exact,      ///< odometry without error
  typical,    ///< a wheeled robot
  arm,
  poses,
  file,  ///< EstimatorOptions::profile
};
DEPTHSERVO_API const char* toString(ErrorKind kind);

/// The errors of this name; none: no such word.
DEPTHSERVO_API std::optional<ErrorKind> errorKindNamed(const std::string& name);

/// Every name; `file` has none.
DEPTHSERVO_API std::vector<std::string> errorKindNames();

/// Which estimator, its first guess and its settings.
struct EstimatorOptions {
  EstimatorKind estimator = EstimatorKind::filter;
  double initial = 1;                ///< first guess for every point [m]
  double Z_min = 0.05, Z_max = 100;  ///< [m]
  bool object = false;               ///< one depth for all points (nonlinear observer)
  bool euler = false;                ///< the nonlinear observer by Euler's method
  ObserverGainOptions gains;
  JointStateOptions joint;
  KnownTargetOptions pose;
  ErrorKind errors = ErrorKind::declared;
  ErrorProfile profile;  ///< with `file`

  DepthRange range() const { return {Z_min, Z_max}; }
};

/// What does not fit together.
DEPTHSERVO_API void check(const EstimatorOptions& depth, const Refuse& refuse);

}  // namespace depthservo
