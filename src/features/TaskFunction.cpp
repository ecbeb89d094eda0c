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

Eigen::VectorXd TaskFunction::command(const Eigen::VectorXd& s,
                                      const Eigen::MatrixXd& cameraJacobian, double gain) const {
  const Eigen::MatrixXd J = cameraJacobian(degreesOfFreedom_, Eigen::all);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(J);
  Eigen::VectorXd qdot = Eigen::VectorXd::Zero(J.cols());
  if (J.rows() != J.cols() || !J.allFinite() || !lu.isInvertible()) return qdot;
  qdot = -gain * lu.solve(error(s));
  if (!qdot.allFinite()) qdot.setZero();
  return qdot;
}

}  // namespace depthservo
