#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/features/PointFeatures.h"
#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/robots/RobotModel.h"
#include "depthservo/servo/ServoGoal.h"
#include "depthservo/servo/ServoOptions.h"
#include "text/Names.h"

namespace depthservo {

/// What a control law can ask besides the features.
struct ControlInput {
  const RobotModel& robot;
  const MotionBuffer& odometry;
  double time_s;  ///< of the run
};

/// Computes the velocities of the robot from the features, image by image.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;

  /// What the robot shall do, after an image. May throw vpException; what is not finite ends the
  /// run.
  virtual Velocities command(const ControlInput& now) = 0;

  /// The same at the beginning of each row of odometry; nothing: the command is held from image to
  /// image.
  virtual std::optional<Velocities> between(const ControlInput&) { return std::nullopt; }

  /// What it is doing besides, in words; empty: nothing.
  virtual const char* activity() const { return ""; }

  /// Whether it steers by the features: without them the command fades out.
  virtual bool usesFeatures() const { return true; }
};

/// What a law is made from.
struct LawSetup {
  ControlOptions control;
  ServoGoal goal;
  PinholeCamera camera;
  Mobility mobility;
  double rowPeriod_s, framePeriod_s;  ///< of odometry and images
  std::string place;                  ///< of the options, for messages
};

DEPTHSERVO_INNER const std::vector<detail::Choice<Law>>& lawWords();

/// \param features and \param estimator outlive the law \throw InputError the law cannot have this
/// goal
std::unique_ptr<ControlLaw> makeControlLaw(const LawSetup& setup, PointFeatures& features,
                                           const PointSetEstimator& estimator);

}  // namespace depthservo
