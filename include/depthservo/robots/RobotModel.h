#pragma once

#include <visp3/core/vpMatrix.h>
#include <visp3/core/vpVelocityTwistMatrix.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// A robot that carries a camera, as a control law sees it: it is driven by n velocities qdot, and
/// the camera's twist is cVe eJe qdot.
class DEPTHSERVO_API RobotModel {
 public:
  virtual ~RobotModel() = default;

  /// Velocities that it has; n zeros before the first command.
  virtual Velocities velocity() const = 0;

  /// Greatest size of each velocity, n; infinite where there is no limit.
  virtual Velocities velocityLimits() const = 0;

  /// What the n velocities are, with their units: "v [m/s]".
  virtual std::vector<std::string> velocityNames() const = 0;

  /// In which directions the camera can be moved.
  virtual Mobility mobility() const { return Mobility::planar; }

  /// Camera twist at the velocities qdot, in the camera frame.
  virtual Twist cameraTwist(const Velocities& velocity) const = 0;

  virtual const DEPTHSERVO_VISP vpMatrix& eJe() const = 0;               ///< 6xn
  virtual const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe() const = 0;  ///< 6x6
};

}  // namespace depthservo
