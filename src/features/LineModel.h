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

    Moved next;
    next.x = ofPluecker(h, w);
    next.F = byPluecker(h, w, dh, dw);
    // A foot behind the camera may be beyond the line's vanishing point: the line is still seen.
    next.isAhead = std::hypot(h.x(), h.y()) > 1e-9;
    return next;
  }

  static Eigen::Matrix<double, 4, 6> rate(const State& x) {
    const double c = std::cos(x[1]), s = std::sin(x[1]);
    const Eigen::Vector3d m(c, s, -x[0]);
    const Eigen::Vector3d u =
        x[3] * Eigen::Vector3d(x[0] * c, x[0] * s, 1) - x[2] * Eigen::Vector3d(-s, c, 0);
    Eigen::Matrix<double, 3, 6> dm, du;  // by the twist: t = -v dt, R = 1 - [w] dt
    dm << cross(u), cross(m);
    du << Eigen::Matrix3d::Zero(), cross(u);
    return byPluecker(m, u, dm, du);
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

  /// From moment and direction, of a common scale.
  static State ofPluecker(const Eigen::Vector3d& m, const Eigen::Vector3d& u) {
    const double size = std::hypot(m.x(), m.y());
    return {-m.z() / size, std::atan2(m.y(), m.x()),
            (m.y() * u.x() - m.x() * u.y()) / (size * size), u.z() / size};
  }

  /// Its derivative, given those of moment and direction by K variables.
  template <typename By>
  static Eigen::Matrix<double, 4, By::ColsAtCompileTime> byPluecker(const Eigen::Vector3d& m,
                                                                    const Eigen::Vector3d& u,
                                                                    const By& dm, const By& du) {
    using Row = Eigen::Matrix<double, 1, By::ColsAtCompileTime>;
    const State x = ofPluecker(m, u);
    const double size = std::hypot(m.x(), m.y());
    const Eigen::Vector3d e(m.x() / size, m.y() / size, 0), q(-e.y(), e.x(), 0);
    const Row dSize = e.transpose() * dm, dTheta = q.transpose() * dm / size;
    const Row dChi = e.dot(u) * dTheta - q.transpose() * du - x[2] * dSize;
    Eigen::Matrix<double, 4, By::ColsAtCompileTime> J;
    J.row(0) = (-dm.row(2) - x[0] * dSize) / size;
    J.row(1) = dTheta;
    J.row(2) = dChi / size;
    J.row(3) = (du.row(2) - x[3] * dSize) / size;
    return J;
  }
};

}  // namespace depthservo
