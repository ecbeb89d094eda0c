#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/motion/VelocityProfile.h"
#include "depthservo/text/Refuse.h"

namespace depthservo {

/// What computes the command: vpServo | task | profile | regulation.
enum class Law { vpServo, task, profile, regulation };

/// What vpServo steers by: points | moments.
enum class FeatureKind { points, moments };

enum class InteractionKind { current, mean, desired };

/// Motion that is added to learn depths; see doc/estimators.md.
struct ExciteOptions {
  double speed = 0.05;  ///< of the camera across the line of sight [m/s]
  double limit = 40;    ///< by which it may displace a point in the image while it lasts [px]
};

constexpr const char* kTaughtAtStart = "start";

struct ControlOptions {
  double gain = 0.57;        ///< lambda [1/s]
  double gain_in_doubt = 1;  ///< factor of it while a depth is vague and the way is long [-]
  ServoDepth depth = ServoDepth::observed;  ///< what the task is given
  std::optional<ExciteOptions> excite;
  double tolerance = 1.5;     ///< rms image error at which the task is done [px]
  bool all_in_image = false;  ///< the run ends as soon as one point is outside the image
  FeatureKind features = FeatureKind::points;
  double size_weight = 1;  ///< value of the third moment feature at the goal [-]
  InteractionKind interaction = InteractionKind::current;
  /// Image sigma predicted for a hidden point at which the robot has been slowed down to a stop;
  /// it goes at full speed up to half of it [px].
  double hidden_sigma = 20;
  double hidden_wait = 10;  ///< it stands still for want of points for at most this long [s]
  Law law = Law::vpServo;
  VelocityProfile profile;  ///< of the robot, for the law of this name
  double kc = 1;            ///< gain of the law regulation [1/s]
  bool coupled = false;     ///< regulation: the coupled law of Ibuki et al. 2023
  /// Folder of a goal that teach wrote; `start`: what is seen from robot.goal, taught at the start.
  std::string taught = kTaughtAtStart;
  std::vector<Eigen::Vector2d> desired;  ///< desired pixels (u, v); empty: seen from robot.goal
};

/// What does not fit together.
DEPTHSERVO_API void check(const ControlOptions& control, const Refuse& refuse);

}  // namespace depthservo
