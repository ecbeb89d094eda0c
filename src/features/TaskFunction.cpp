#include "depthservo/features/TaskFunction.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <stdexcept>

#include "features/pointInteraction.h"

namespace depthservo {

TaskFunction::TaskFunction(const std::vector<PointState>& desired,
                           std::vector<int> degreesOfFreedom)
    : degreesOfFreedom_(std::move(degreesOfFreedom)),
      s_star_(2 * desired.size()),
      L_(2 * desired.size(), degreesOfFreedom_.size()) {
  for (std::size_t i = 0; i < desired.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    s_star_.segment<2>(row) << desired[i].x, desired[i].y;
    L_.middleRows<2>(row) = pointInteraction(desired[i])(Eigen::all, degreesOfFreedom_);
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr(L_);
  if (!L_.allFinite() || qr.rank() < L_.cols()) {
    throw std::invalid_argument("the points do not determine the task: rank of L is " +
                                std::to_string(qr.rank()) + " of " + std::to_string(L_.cols()));
  }
  C_ = qr.pseudoInverse();
}

TaskFunction::Error TaskFunction::error(const Eigen::VectorXd& s) const {
  Error e = Error::Zero(C_.rows());
  for (Eigen::Index j = 0; j < C_.cols(); ++j) e += (s[j] - s_star_[j]) * C_.col(j);
  return e;
}

Velocities TaskFunction::command(const Eigen::VectorXd& s,
                                 const Eigen::Ref<const Eigen::MatrixXd>& cameraJacobian,
                                 double gain) const {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
  const auto d = static_cast<Eigen::Index>(degreesOfFreedom_.size());
  Velocities qdot = Velocities::Zero(cameraJacobian.cols());
  if (cameraJacobian.cols() != d) return qdot;
  Square J(d, d);
  for (Eigen::Index i = 0; i < d; ++i) {
    J.row(i) = cameraJacobian.row(degreesOfFreedom_[static_cast<std::size_t>(i)]);
  }
  const Eigen::FullPivLU<Square> lu(J);
  if (!J.allFinite() || !lu.isInvertible()) return qdot;
  qdot = -gain * lu.solve(error(s));
  if (!qdot.allFinite()) qdot.setZero();
  return qdot;
}

}  // namespace depthservo
