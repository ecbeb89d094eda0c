#include "tracking/saddle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "depthservo/visp/using.h"

namespace depthservo::detail {
namespace {

constexpr int kMostRounds = 12;
constexpr double kStill_px = 1e-3;
constexpr double kLeastGradient = 4;  // of the weaker edge, rms over the window [gray levels / px]
constexpr double kFloor_px = 0.02;    // what discretisation leaves
constexpr double kSmallWindow =
    0.85;  // px^3: over the square of the reach, what is left of small ones

struct Sums {
  Eigen::Matrix2d gg = Eigen::Matrix2d::Zero(), covariance = gg;  // of ggp, by noise of 1 level
  Eigen::Vector2d ggp = Eigen::Vector2d::Zero();                  // about the middle
  double weight = 0;
};

/// Over the window about a point that lies in the image with all of it.
Sums sumsAbout(const vpImage<unsigned char>& image, const Eigen::Vector2d& q, double reach_px) {
  Sums sums;
  const double inverse = 2 / (reach_px * reach_px);  // of twice the variance of the weight
  const auto first = [&](double x) { return static_cast<int>(std::ceil(x - reach_px)); };
  const auto last = [&](double x) { return static_cast<int>(std::floor(x + reach_px)); };
  for (int v = first(q.y()); v <= last(q.y()); ++v) {
    const auto row = static_cast<unsigned>(v);
    for (int u = first(q.x()); u <= last(q.x()); ++u) {
      const Eigen::Vector2d d(u - q.x(), v - q.y());
      const double w = std::exp(-inverse * d.squaredNorm());
      const Eigen::Vector2d g(0.5 * (image[row][u + 1] - image[row][u - 1]),
                              0.5 * (image[row + 1][u] - image[row - 1][u]));
      const double across = g.dot(d);
      sums.gg += w * g * g.transpose();
      sums.ggp += w * across * g;
      // Noise of a gradient, half the variance of a pixel, by its own error and by its arm.
      const double w2 = 0.5 * w * w;
      sums.covariance += w2 * (d.squaredNorm() * g * g.transpose());
      sums.covariance.diagonal().array() += w2 * across * across;
      sums.weight += w;
    }
  }
  return sums;
}

}  // namespace

std::optional<Saddle> refineSaddle(const vpImage<unsigned char>& image,
                                   const Eigen::Vector2d& rough, double reach_px,
                                   double grayNoise) {
  Eigen::Vector2d q = rough;
  const Eigen::Vector2d end(image.getWidth() - 2.0 - reach_px, image.getHeight() - 2.0 - reach_px);
  for (int round = 0; round < kMostRounds; ++round) {
    if (!((q.array() >= 1 + reach_px).all() && (q.array() <= end.array()).all())) return {};
    const Sums sums = sumsAbout(image, q, reach_px);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> edges(sums.gg);
    if (!(edges.eigenvalues()[0] > kLeastGradient * kLeastGradient * sums.weight)) return {};
    const Eigen::Matrix2d inverse = sums.gg.inverse();
    const Eigen::Vector2d step = inverse * sums.ggp;
    q += step;
    if (!((q - rough).norm() < reach_px)) return {};
    if (step.norm() > kStill_px) continue;
    const Eigen::Matrix2d C = inverse * sums.covariance * inverse;
    const double floor_px = std::max(kFloor_px, kSmallWindow / (reach_px * reach_px));
    return Saddle{q, std::sqrt(0.5 * grayNoise * grayNoise * C.trace() + floor_px * floor_px)};
  }
  return {};
}

}  // namespace depthservo::detail
