#pragma once

#include <Eigen/Core>
#include <cmath>

#include "depthservo/motion/Flow.h"

namespace depthservo {

/// A straight line for ShapeFilter: (rho, theta, chi, slope), where x cos(theta) + y sin(theta) =
/// rho, chi is the inverse depth at its foot p0 = rho (cos, sin), and slope that of the inverse
/// depth along it (direction q = (-sin, cos)): chi(p0 + l q) = chi + slope l. Those two are all
/// that a line has of depth (Spica, Robuffo Giordano, Chaumette 2014).
///
/// In space it has the direction u = slope (p0, 1) - chi (q, 0) and the moment m = P x u = (cos,
/// sin, -rho), which a motion takes exactly to R u and R m + t x R u.
struct LineModel {
  static constexpr int kStates = 4, kMeasured = 2;
  static constexpr double kGate = 13.8;
  using State = Eigen::Vector4d;
  using Square = Eigen::Matrix4d;

  struct Moved {
    State x;
    Square F;
    Eigen::Matrix<double, 4, 6> L;
    bool isAhead;
  };

  static Moved moved(const Motion& motion, const State& x) {
    const double rho = x[0], chi = x[2], slope = x[3];
    const double c = std::cos(x[1]), s = std::sin(x[1]);
    const Eigen::Vector3d e(c, s, 0), q(-s, c, 0), p0(rho * c, rho * s, 1), m(c, s, -rho);
    Eigen::Matrix<double, 3, 4> dm, du;  // by (rho, theta, chi, slope)
    dm << -Eigen::Vector3d::UnitZ(), q, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero();
    du << slope * e, slope * rho * q + chi * e, -q, p0;
    const Eigen::Vector3d w = motion.R * (slope * p0 - chi * q);
    const Eigen::Matrix<double, 3, 4> dw = motion.R * du;
    const Eigen::Vector3d h = motion.R * m + motion.t.cross(w);
    Eigen::Matrix<double, 3, 4> dh = motion.R * dm;
    for (int i = 0; i < 4; ++i) dh.col(i) += motion.t.cross(dw.col(i));

    const double size = std::sqrt(h.x() * h.x() + h.y() * h.y());
    // A foot behind the camera may be beyond the line's vanishing point: the line is still seen.
    if (!(size > 1e-9)) return {x, {}, {}, false};
    const Eigen::Vector3d m1 = h / size, u1 = w / size;
    Moved next;
    next.isAhead = true;
    next.x << -m1.z(), std::atan2(m1.y(), m1.x()), m1.y() * u1.x() - m1.x() * u1.y(), u1.z();
    next.F = byPluecker<4>(next.x, m1, u1, dh / size, dw / size);
    // By the twist: t = -v dt, R = 1 - [w] dt.
    Eigen::Matrix<double, 3, 6> dm1, du1;
    dm1 << cross(u1), cross(m1);
    du1 << Eigen::Matrix3d::Zero(), cross(u1);
    next.L = byPluecker(next.x, m1, u1, dm1, du1);
    return next;
  }

  static Eigen::Vector2d innovation(const Eigen::Vector2d& z, const State& x) {
    double theta = std::remainder(z[1] - x[1], 2 * M_PI), rho = z[0];
    if (std::abs(theta) > M_PI / 2) {  // the same line the other way round
      theta = std::remainder(theta + M_PI, 2 * M_PI);
      rho = -rho;
    }
    return {rho - x[0], theta};
  }

  struct Guess {
    State x;
    Square P;
  };
  static Guess start(const Eigen::Vector2d& z, double chi, double sigma) {
    return {{z[0], z[1], chi, 0}, Eigen::Vector4d(0, 0, sigma * sigma, sigma * sigma).asDiagonal()};
  }

  static PointState centre(const State& x) {
    return {x[0] * std::cos(x[1]), x[0] * std::sin(x[1]), x[2]};
  }
  static Eigen::RowVector4d byChi(const State&) { return {0, 0, 1, 0}; }

 private:
  static Eigen::Matrix3d cross(const Eigen::Vector3d& a) {
    Eigen::Matrix3d A;
    A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return A;
  }

  /// Derivative of the state of a line of moment m = (cos, sin, -rho) and direction u, given
  /// those of m and u, up to a common scale, by some variables.
  template <int K>
  static Eigen::Matrix<double, 4, K> byPluecker(const State& x, const Eigen::Vector3d& m,
                                                const Eigen::Vector3d& u,
                                                const Eigen::Matrix<double, 3, K>& dm,
                                                const Eigen::Matrix<double, 3, K>& du) {
    using Row = Eigen::Matrix<double, 1, K>;
    const double c = m.x(), s = m.y();
    const Row dSize = c * dm.row(0) + s * dm.row(1), dTheta = c * dm.row(1) - s * dm.row(0);
    Eigen::Matrix<double, 4, K> J;
    J.row(0) = -dm.row(2) - x[0] * dSize;
    J.row(1) = dTheta;
    J.row(2) = (c * u.x() + s * u.y()) * dTheta + s * du.row(0) - c * du.row(1) - x[2] * dSize;
    J.row(3) = du.row(2) - x[3] * dSize;
    return J;
  }
};

}  // namespace depthservo
