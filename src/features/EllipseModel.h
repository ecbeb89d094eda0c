#pragma once

#include <Eigen/Core>

#include "depthservo/motion/Flow.h"
#include "features/planeFlow.h"

namespace depthservo {

/// An ellipse of any plane for ShapeFilter: (x, y, n20, n11, n02, A, B, C), centre and normalised
/// second moments as of vpFeatureEllipse, and 1/Z = A x + B y + C.
///
/// A motion takes the plane's image by the homography H = R + t (A, B, C), and the dual conic
///     D = (x^2 - 4 n20, x y - 4 n11, x;  ., y^2 - 4 n02, y;  ., ., 1)
/// to H D H', up to its scale: exact.
struct EllipseModel {
  static constexpr int kStates = 8, kMeasured = 5;
  static constexpr double kGate = 20.5;
  using State = Eigen::Matrix<double, 8, 1>;
  using Square = Eigen::Matrix<double, 8, 8>;
  using Measured = Eigen::Matrix<double, 5, 1>;

  struct Moved {
    State x;
    Square F;
    Eigen::Matrix<double, 8, 6> L;
    bool isAhead;
  };

  static Moved moved(const Motion& motion, const State& x) {
    const Eigen::Vector3d abc = x.tail<3>();
    const PlaneFlow plane = planeFlow(motion, abc);
    const Eigen::Matrix3d H = motion.R + motion.t * abc.transpose();
    const Eigen::Matrix3d HD = H * dual(x);
    const Eigen::Matrix3d D = HD * H.transpose();
    Moved next;
    next.x << ofDual(D), plane.abc;
    next.isAhead = plane.isAhead && D(2, 2) > 1e-12;
    const Eigen::Vector3d p = H * Eigen::Vector3d(x[0], x[1], 1);
    next.F.setZero();
    next.F.block<5, 1>(0, 0) = byDual(D, H.col(0), p);
    next.F.block<5, 1>(0, 1) = byDual(D, H.col(1), p);
    next.F.block<5, 1>(0, 2) = byDual(D, -2 * H.col(0), H.col(0));
    next.F.block<5, 1>(0, 3) = byDual(D, -4 * H.col(0), H.col(1));
    next.F.block<5, 1>(0, 4) = byDual(D, -2 * H.col(1), H.col(1));
    for (int i = 0; i < 3; ++i) next.F.block<5, 1>(0, 5 + i) = byDual(D, motion.t, HD.col(i));
    next.F.bottomRightCorner<3, 3>() = plane.J;
    next.L = rate(next.x);
    return next;
  }

  static Measured innovation(const Measured& z, const State& x) { return z - x.head<5>(); }

  struct Guess {
    State x;
    Square P;
  };
  /// A plane that faces the camera, and may be tilted any way.
  static Guess start(const Measured& z, double chi, double sigma) {
    Guess guess;
    guess.x << z, 0, 0, chi;
    Eigen::Matrix3d byTilt = Eigen::Matrix3d::Identity();  // of (A, B, C) by (A, B, chi at centre)
    byTilt.row(2) << -z[0], -z[1], 1;
    guess.P.setZero();
    guess.P.bottomRightCorner<3, 3>() = sigma * sigma * byTilt * byTilt.transpose();
    return guess;
  }

  static PointState centre(const State& x) {
    return {x[0], x[1], x[5] * x[0] + x[6] * x[1] + x[7]};
  }
  static Eigen::Matrix<double, 1, 8> byChi(const State& x) {
    Eigen::Matrix<double, 1, 8> g;
    g << x[5], x[6], 0, 0, 0, x[0], x[1], 1;
    return g;
  }

 private:
  /// Chaumette 2004, (14) and (26), and that of the plane.
  static Eigen::Matrix<double, 8, 6> rate(const State& s) {
    const double x = s[0], y = s[1], n20 = s[2], n11 = s[3], n02 = s[4];
    const double A = s[5], B = s[6], C = s[7], chi = A * x + B * y + C;
    const double a = A * n20 + B * n11, b = A * n11 + B * n02;
    Eigen::Matrix<double, 8, 6> L;
    L << -chi, 0, x * chi + 4 * a, x * y + 4 * n11, -1 - x * x - 4 * n20, y,  //
        0, -chi, y * chi + 4 * b, 1 + y * y + 4 * n02, -x * y - 4 * n11, -x,  //
        -2 * a, 0, 2 * (chi * n20 + x * a), 2 * (y * n20 + x * n11), -4 * n20 * x, 2 * n11, -b, -a,
        y * a + x * b + 2 * chi * n11, 3 * y * n11 + x * n02, -y * n20 - 3 * x * n11,
        n02 - n20,  //
        0, -2 * b, 2 * (chi * n02 + y * b), 4 * y * n02, -2 * (y * n11 + x * n02), -2 * n11, A * A,
        A * B, A * C, 0, -C, B,         //
        A * B, B * B, B * C, C, 0, -A,  //
        A * C, B * C, C * C, -B, A, 0;
    return L;
  }

  static Eigen::Matrix3d dual(const State& s) {
    Eigen::Matrix3d D;
    D << s[0] * s[0] - 4 * s[2], s[0] * s[1] - 4 * s[3], s[0],  //
        s[0] * s[1] - 4 * s[3], s[1] * s[1] - 4 * s[4], s[1],   //
        s[0], s[1], 1;
    return D;
  }

  static Measured ofDual(const Eigen::Matrix3d& D) {
    const double x = D(0, 2) / D(2, 2), y = D(1, 2) / D(2, 2);
    return (Measured() << x, y, (x * x - D(0, 0) / D(2, 2)) / 4, (x * y - D(0, 1) / D(2, 2)) / 4,
            (y * y - D(1, 1) / D(2, 2)) / 4)
        .finished();
  }

  /// Derivative of ofDual(D) where D grows by a b' + b a'.
  static Measured byDual(const Eigen::Matrix3d& D, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
    const double w = 1 / D(2, 2), x = w * D(0, 2), y = w * D(1, 2), g = 2 * a.z() * b.z();
    const double dx = w * (a.x() * b.z() + a.z() * b.x() - x * g);
    const double dy = w * (a.y() * b.z() + a.z() * b.y() - y * g);
    const double d00 = w * (2 * a.x() * b.x() - w * D(0, 0) * g);
    const double d01 = w * (a.x() * b.y() + a.y() * b.x() - w * D(0, 1) * g);
    const double d11 = w * (2 * a.y() * b.y() - w * D(1, 1) * g);
    return (Measured() << dx, dy, (2 * x * dx - d00) / 4, (x * dy + y * dx - d01) / 4,
            (2 * y * dy - d11) / 4)
        .finished();
  }
};

}  // namespace depthservo
