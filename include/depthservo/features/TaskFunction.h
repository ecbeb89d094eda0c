#pragma once

#include <Eigen/Core>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Flow.h"
#include "depthservo/motion/Velocities.h"

namespace depthservo {

/// The task-function control law (Durand Petiteville, Courdesses, Cadenat 2010, eq. 8; Samson, Le
/// Borgne, Espiau 1991): with the interaction matrix L of the points at the goal, for the d degrees
/// of freedom that the camera has,
///     e = C (s - s*),   C = L^+(s*, Z*) (d x 2n),   C L = I
///     qdot = -gain J^-1 e,   J (d x d): velocities of the camera's degrees of freedom by the
///     robot's
/// Only depths at the goal enter. s = (x_1, y_1, ..., x_n, y_n), normalised.
class DEPTHSERVO_API TaskFunction {
 public:
  /// A number for each degree of freedom (d), of which there are at most six.
  using Error = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;

  /// Degrees of freedom of a camera with a horizontal optical axis on a robot on the floor: vx, vz
  /// and wy of (vx, vy, vz, wx, wy, wz).
  static std::vector<int> planar() { return {0, 2, 4}; }
  static std::vector<int> all() { return {0, 1, 2, 3, 4, 5}; }

  /// \param desired the points at the goal, chi > 0 \param degreesOfFreedom indices into (vx, vy,
  /// vz, wx, wy, wz) \throw std::invalid_argument the points do not determine them
  TaskFunction(const std::vector<PointState>& desired, std::vector<int> degreesOfFreedom);

  /// e (d) at the features s (2n): to first order the camera's way from the goal [m, rad].
  Error error(const Eigen::VectorXd& s) const;

  /// Velocities of the robot. \param s 2n \param cameraJacobian 6xd, camera twist by robot
  /// velocities: cVe eJe \param gain [1/s]. Zero when the Jacobian is singular or anything is not
  /// finite. \rtsafe
  Velocities command(const Eigen::VectorXd& s,
                     const Eigen::Ref<const Eigen::MatrixXd>& cameraJacobian, double gain) const;

  const Eigen::VectorXd& desired() const { return s_star_; }  ///< s* (2n)
  const Eigen::MatrixXd& C() const { return C_; }
  const Eigen::MatrixXd& L() const { return L_; }  ///< 2n x d

 private:
  std::vector<int> degreesOfFreedom_;
  Eigen::VectorXd s_star_;
  Eigen::MatrixXd L_, C_;
};

}  // namespace depthservo
