#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/scenario/Scenario.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/robots/CameraRobot.h"
#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

/// Where the task is done.
struct ServoGoal {
  std::vector<Eigen::Vector2d> pixels;    ///< by point [px]
  std::vector<double> Z;                  ///< by point [m]; the first guess where unknown
  std::optional<Eigen::Isometry3d> cdMo;  ///< pose of the target in the camera, when known
};

/// What a control law can ask besides the features.
struct ControlInput {
  const CameraRobot& robot;
  const MotionBuffer& odometry;
  double time_s;  ///< of the run
};

/// Computes the velocities of the robot from the features, image by image.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;

  /// What the robot shall do, after an image. May throw vpException; what is not finite ends the
  /// run.
  virtual Eigen::VectorXd command(const ControlInput& now) = 0;

  /// The same at the beginning of each row of odometry; nothing: the command is held from image to
  /// image.
  virtual std::optional<Eigen::VectorXd> between(const ControlInput&) { return std::nullopt; }

  /// What it is doing besides, in words; empty: nothing.
  virtual std::string state() const { return ""; }

  /// Whether it steers by the features: without them the command fades out.
  virtual bool usesFeatures() const { return true; }
};

/// The law of a scenario. \param features outlive it
std::unique_ptr<ControlLaw> makeControlLaw(const Scenario& scenario, const ServoGoal& goal,
                                           FeaturePointGroup& features);

}  // namespace depthservo
