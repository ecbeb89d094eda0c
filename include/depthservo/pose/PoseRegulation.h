#pragma once

#include <Eigen/Geometry>
#include <limits>

#include "depthservo/api.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/pose/PoseError.h"

namespace depthservo {

/// Freedom of the robot that carries the camera.
enum class Mobility {
  full,   ///< all six components
  planar  ///< v_x, v_z and w_y only: a camera on an omnidirectional base
};

struct PoseRegulationOptions {
  double kc = 1;  ///< gain [1/s], > 0; the pose error decays at this rate
  Mobility mobility = Mobility::full;
  double maxLinear = std::numeric_limits<double>::infinity();   ///< speed limit [m/s]
  double maxAngular = std::numeric_limits<double>::infinity();  ///< turn rate limit [rad/s]
};

/// Drives the camera to a desired pose of the target, moving or not:
///
///     V_wc = kc Ad(g_d) e_c,    e_c = vec(g_d^-1 g_co)
///
/// with g_co the estimated and g_d the desired pose of the target in the camera (Ibuki et al. 2023,
/// eq. 22). Evaluate it at odometry rate. A target with constant twist V is followed with an error
/// |e_c| = V/kc. With a VisualMotionObserver as it is ("cascade") the estimate does not depend on
/// this law; with its `coupledGoal` set to g_d the two are the paper's coupled law, whose stability
/// proof covers both at once but whose estimate is pulled towards g_d while the camera is on its
/// way.
///
/// Real-time: nothing allocates or throws. A pose that is not finite gives the zero twist.
class DEPTHSERVO_API PoseRegulation {
 public:
  using Options = PoseRegulationOptions;

  /// \param cdMo desired pose of the target in the camera
  explicit PoseRegulation(const Eigen::Isometry3d& cdMo, const Options& options = {});

  /// e_c, of the estimated pose of the target in the camera.
  Vector6d error(const Eigen::Isometry3d& cMo) const;

  /// Twist of the camera, in the camera frame; beyond a limit all components are reduced by a
  /// common factor.
  Twist command(const Eigen::Isometry3d& cMo) const;

 private:
  Eigen::Isometry3d cdMo_, oMcd_;
  Options options_;
};

}  // namespace depthservo
