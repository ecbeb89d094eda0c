#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace depthservo::test {

/// Whether two matrices agree within `tolerance` in every entry; says both sides and the
/// difference.
template <typename A, typename B>
::testing::AssertionResult matricesNear(const char* nameA, const char* nameB, const char*,
                                        const Eigen::MatrixBase<A>& a,
                                        const Eigen::MatrixBase<B>& b, double tolerance) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) {
    return ::testing::AssertionFailure() << nameA << " is " << a.rows() << "x" << a.cols() << ", "
                                         << nameB << " is " << b.rows() << "x" << b.cols();
  }
  const Eigen::MatrixXd difference = a - b;
  const double largest = difference.cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
  if (largest <= tolerance) return ::testing::AssertionSuccess();
  const Eigen::IOFormat format(17, 0, ", ", "\n", "  [", "]");
  return ::testing::AssertionFailure()
         << nameA << " =\n"
         << a.format(format) << "\n"
         << nameB << " =\n"
         << b.format(format) << "\ndifference =\n"
         << difference.format(format) << "\nlargest " << largest << ", tolerance " << tolerance;
}

}  // namespace depthservo::test

#define EXPECT_MATRIX_NEAR(a, b, tolerance) \
  EXPECT_PRED_FORMAT3(::depthservo::test::matricesNear, a, b, tolerance)
