#pragma once

#include <Eigen/Core>
#include <cmath>

#include "depthservo/motion/Flow.h"
#include "motion/rateByTwist.h"

namespace depthservo {

/// A sphere for ShapeFilter: (x, y, tau, chi) of its centre, tau = radius chi. Centre and tau are
/// read off its image exactly, and keep tau/chi, the unknown radius, whatever the motion.
struct SphereModel {
  static constexpr int kStates = 4, kMeasured = 3;
  static constexpr double kGate = 16.3;
  using State = Eigen::Vector4d;
  using Square = Eigen::Matrix4d;
  using Measured = Eigen::Vector3d;
  using Ellipse = Eigen::Matrix<double, 5, 1>;  // x, y, n20, n11, n02

  struct Moved {
    State x;
    Square F;
    Eigen::Matrix<double, 4, 6> L;
    bool isAhead;
  };

  static Moved moved(const Motion& motion, const State& x) {
    const PointState before{x[0], x[1], x[3]};
    const Flow after = flow(motion, before);
    if (!after.ahead) return {x, {}, {}, false};
    const Eigen::Matrix3d J = flowJacobian(motion, before, after.point);
    const Eigen::Vector3d g(motion.R(2, 0), motion.R(2, 1), motion.t.z());
    const double k = 1 / (g.x() * x[0] + g.y() * x[1] + motion.R(2, 2) + g.z() * x[3]);
    const State now(after.point.x, after.point.y, x[2] * k, after.point.chi);
    Moved next{now, Square::Zero(), rate(now), true};
    const int point[]{0, 1, 3};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) next.F(point[i], point[j]) = J(i, j);
      next.F(2, point[i]) = -x[2] * k * k * g[i];
    }
    next.F(2, 2) = k;
    return next;
  }

  static Measured innovation(const Measured& z, const State& x) { return z - x.head<3>(); }

  struct Guess {
    State x;
    Square P;
  };
  static Guess start(const Measured& z, double chi, double sigma) {
    return {{z[0], z[1], z[2], chi}, Eigen::Vector4d(0, 0, 0, sigma * sigma).asDiagonal()};
  }

  static PointState centre(const State& x) { return {x[0], x[1], x[3]}; }
  static Eigen::RowVector4d byChi(const State&) { return {0, 0, 0, 1}; }

  /// The centre and tau whose image this ellipse is: with r^2 = x^2 + y^2, N = n20 + n02,
  ///     r^2 q^2 - (r^2 + 2 + 4 N) q + 4 N = 0,   q = tau^2.
  static Measured ofEllipse(const Ellipse& s) {
    const double r2 = s[0] * s[0] + s[1] * s[1], n4 = 4 * (s[2] + s[4]), b = r2 + 2 + n4;
    const double q = 2 * n4 / (b + std::sqrt(b * b - 4 * r2 * n4));
    return {(1 - q) * s[0], (1 - q) * s[1], std::sqrt(q)};
  }

  static Ellipse toEllipse(const State& x) {
    const double q = x[2] * x[2], k = 1 / (1 - q), k4 = q * k * k / 4;
    return (Ellipse() << k * x[0], k * x[1], k4 * (1 + x[0] * x[0] - q), k4 * x[0] * x[1],
            k4 * (1 + x[1] * x[1] - q))
        .finished();
  }

  /// (A, B, C) of the plane of its limb, for a depth that may be another.
  static Eigen::Vector3d plane(const State& x, double chi) {
    const Eigen::Vector3d m(x[0], x[1], 1);
    return chi / (m.squaredNorm() - x[2] * x[2]) * m;
  }

 private:
  static Eigen::Matrix<double, 4, 6> rate(const State& x) {
    const Eigen::Matrix<double, 3, 6> L = rateByTwist({x[0], x[1], x[3]});
    Eigen::Matrix<double, 4, 6> rates;
    rates << L.topRows<2>(), 0, 0, x[2] * x[3], x[2] * x[1], -x[2] * x[0], 0, L.row(2);
    return rates;
  }
};

}  // namespace depthservo
