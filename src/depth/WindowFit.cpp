#include "depthservo/depth/WindowFit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// S [m^2] below which there is no baseline.
constexpr double kNoBaseline = 1e-12;

/// Image and inverse-depth noise are taken to be at least this, so that exact data have weights.
constexpr double kLeastSigma = 1e-9;

constexpr int kGaussNewtonSteps = 2, kHuberSteps = 3, kTukeySteps = 10;

double variance(double sigma) {
  const double atLeast = std::max(sigma, kLeastSigma);
  return atLeast * atLeast;
}

/// What a depth measured in an earlier image says of the one now: Z_now = alpha Z_there + t3.
DirectDepth depthNow(const DirectDepth& there, double alpha, double t3) {
  const double w = alpha + t3 * there.chi;
  return {there.chi / w, alpha / (w * w) * std::sqrt(variance(there.sigma))};
}

/// Where the point of an earlier image may be now: m = A + B chi.
struct Line {
  Eigen::Vector2d A, B;
  double alpha, t3;
  Eigen::Vector2d H_B;  // (dA/dm_j)^T B

  explicit Line(const WindowImage& image) {
    const Eigen::Matrix3d R = image.toThere.R.transpose();
    const Eigen::Vector3d t = -(R * image.toThere.t);
    const Eigen::Vector3d q = R * Eigen::Vector3d(image.point.x, image.point.y, 1);
    alpha = q.z();
    t3 = t.z();
    A = q.head<2>() / alpha;
    B = t.head<2>() - A * t3;
    H_B = (R.topLeftCorner<2, 2>().transpose() * B -
           A.dot(B) * R.bottomLeftCorner<1, 2>().transpose()) /
          alpha;
  }
};

/// What least squares needs to know of the images. The residual m - A - B chi has the noise
/// n_m - (1 - t3 chi) dA/dm_j n_j: the first is common to all, the second not.
struct Sums {
  double S = 0, B_r = 0;  // |B|^2, B.(m - A)
  Eigen::Vector2d B = Eigen::Vector2d::Zero();
  double V0 = 0, V1 = 0, V2 = 0;         // sigma_j^2 |H_B|^2 times 1, t3, t3^2
  double information = 0, informed = 0;  // direct depths: 1/variance, chi/variance

  void add(const Line& line, const Eigen::Vector2d& m, double sigma2) {
    S += line.B.squaredNorm();
    B_r += line.B.dot(m - line.A);
    B += line.B;
    const double V = sigma2 * line.H_B.squaredNorm();
    V0 += V;
    V1 += V * line.t3;
    V2 += V * line.t3 * line.t3;
  }
  void add(const DirectDepth& direct) {
    const double weight = 1 / variance(direct.sigma);
    information += weight;
    informed += weight * direct.chi;
  }
};

enum class Weighting { none, huber, tukey };

/// Weight of an image whose residual has this square, in units of sigma^2.
double weight(Weighting weighting, double squared) {
  constexpr double kHuber = 2, kTukey = 4.685;
  switch (weighting) {
    case Weighting::none:
      return 1;
    case Weighting::huber:
      return squared > kHuber * kHuber ? kHuber / std::sqrt(squared) : 1;
    case Weighting::tukey: {
      const double inside = 1 - squared / (kTukey * kTukey);
      return inside > 0 ? inside * inside : 0;
    }
  }
  return 1;
}

/// One pass over the images at a point: Gauss-Newton's H dp = g.
struct NormalEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double cost = 0;
  int residuals = 0;
  bool ahead = true;  // of all cameras

  NormalEquations(const WindowImages& images, const Eigen::Vector3d& p, Weighting weighting) {
    add(images.newest, p, weighting);
    for (std::size_t i = 0; i < images.n; ++i) add(images.earlier[i], p, weighting);
    H.triangularView<Eigen::StrictlyLower>() = H.transpose();
  }

 private:
  void add(const WindowImage& image, const Eigen::Vector3d& p, Weighting weighting) {
    const Eigen::Matrix3d& R = image.toThere.R;
    const Eigen::Vector3d& t = image.toThere.t;
    const Eigen::Vector3d q = p.x() * R.col(0) + p.y() * R.col(1) + R.col(2) + p.z() * t;
    if (!(q.z() > 0)) {
      ahead = false;
      return;
    }
    const double scale = 1 / q.z();
    const double x = q.x() * scale, y = q.y() * scale;
    const Eigen::Vector3d row3(R(2, 0), R(2, 1), t.z());
    const Eigen::Vector3d Jx = scale * (Eigen::Vector3d(R(0, 0), R(0, 1), t.x()) - x * row3);
    const Eigen::Vector3d Jy = scale * (Eigen::Vector3d(R(1, 0), R(1, 1), t.y()) - y * row3);
    const double rx = image.point.x - x, ry = image.point.y - y;
    const double information = 1 / variance(image.point.sigma);
    const double squared = (rx * rx + ry * ry) * information;
    const double share = weight(weighting, squared);
    accumulate(Jx, rx, share * information);
    accumulate(Jy, ry, share * information);
    cost += share * squared;
    if (share > 0) residuals += 2;
    if (!image.depth.isKnown()) return;
    const double chi = p.z() * scale;
    const Eigen::Vector3d Jchi = scale * (Eigen::Vector3d::UnitZ() - chi * row3);
    const double rchi = image.depth.chi - chi, wchi = 1 / variance(image.depth.sigma);
    accumulate(Jchi, rchi, wchi);
    cost += rchi * rchi * wchi;
    ++residuals;
  }

  void accumulate(const Eigen::Vector3d& J, double r, double w) {
    const Eigen::Vector3d wJ = w * J;
    H(0, 0) += wJ(0) * J(0);
    H(0, 1) += wJ(0) * J(1);
    H(0, 2) += wJ(0) * J(2);
    H(1, 1) += wJ(1) * J(1);
    H(1, 2) += wJ(1) * J(2);
    H(2, 2) += wJ(2) * J(2);
    g += r * wJ;
  }
};

WindowDegeneracy degeneracyOf(const WindowFit& fit) {
  if (!fit.point.allFinite() || !fit.covariance.allFinite()) return WindowDegeneracy::behind;
  return fit.chi() > 0 ? WindowDegeneracy::none : WindowDegeneracy::infinity;
}

/// A Gauss-Newton pass at the point of the fit: its covariance and cost, and the step to take.
struct Pass {
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  WindowDegeneracy degeneracy = WindowDegeneracy::none;

  Pass(WindowFit& fit, const WindowImages& images, Weighting weighting) {
    const NormalEquations normal(images, fit.point, weighting);
    const Eigen::LLT<Eigen::Matrix3d> llt(normal.H);
    if (!normal.ahead) {
      degeneracy = WindowDegeneracy::behind;
    } else if (llt.info() != Eigen::Success) {
      degeneracy = WindowDegeneracy::noBaseline;
    } else {
      step = llt.solve(normal.g);
      fit.covariance = llt.solve(Eigen::Matrix3d::Identity());
      fit.cost = normal.cost;
      fit.dof = normal.residuals - 3;
    }
  }
};

/// Moves the fit by Gauss-Newton steps until one fails.
WindowDegeneracy iterate(WindowFit& fit, const WindowImages& images, Weighting weighting,
                         int steps) {
  for (int i = 0; i < steps; ++i) {
    const Pass pass(fit, images, weighting);
    if (pass.degeneracy != WindowDegeneracy::none) return pass.degeneracy;
    fit.point += pass.step;
  }
  return WindowDegeneracy::none;
}

/// Whether least squares gave a point to start from; beyond infinity is one.
bool isStart(const WindowFit& fit) {
  return fit.degeneracy == WindowDegeneracy::none || fit.degeneracy == WindowDegeneracy::infinity;
}

/// Covariance, cost and degeneracy at the final point.
void finish(WindowFit& fit, const WindowImages& images, Weighting weighting) {
  if (fit.degeneracy == WindowDegeneracy::none) {
    fit.degeneracy = Pass(fit, images, weighting).degeneracy;
  }
  if (fit.degeneracy == WindowDegeneracy::none) fit.degeneracy = degeneracyOf(fit);
}

}  // namespace

const char* toString(WindowDegeneracy degeneracy) {
  switch (degeneracy) {
    case WindowDegeneracy::none:
      return "none";
    case WindowDegeneracy::noBaseline:
      return "no baseline";
    case WindowDegeneracy::behind:
      return "behind";
    case WindowDegeneracy::infinity:
      return "infinity";
  }
  return "";
}

DirectDepth DirectDepth::fusedWith(const DirectDepth& other) const {
  if (!isKnown() || !other.isKnown()) return isKnown() ? *this : other;
  const double share = variance(other.sigma) / (variance(sigma) + variance(other.sigma));
  return {share * chi + (1 - share) * other.chi, std::sqrt(share * variance(sigma))};
}

WindowFit fitLeastSquares(const WindowImages& images) {
  const PointMeasurement& newest = images.newest.point;
  WindowFit fit;
  fit.point << newest.x, newest.y, 0;
  const Eigen::Vector2d m = fit.point.head<2>();

  Sums sums;
  if (images.newest.depth.isKnown()) sums.add(images.newest.depth);
  for (std::size_t i = 0; i < images.n; ++i) {
    const WindowImage& image = images.earlier[i];
    const Line line(image);
    if (!(line.alpha > 0)) {
      fit.degeneracy = WindowDegeneracy::behind;
      return fit;
    }
    sums.add(line, m, variance(image.point.sigma));
    if (image.depth.isKnown()) sums.add(depthNow(image.depth, line.alpha, line.t3));
  }

  const double sigma2 = variance(newest.sigma);
  Eigen::Vector2d J_chi_m = Eigen::Vector2d::Zero();
  if (sums.S >= kNoBaseline) {
    const double chi = sums.B_r / sums.S;
    const double past = std::max(0.0, sums.V0 - chi * (2 * sums.V1 - chi * sums.V2));
    const double variance_chi = (sigma2 * sums.B.squaredNorm() + past) / (sums.S * sums.S);
    const double share = 1 / (1 + variance_chi * sums.information);  // of the images
    fit.point.z() = share * (chi + variance_chi * sums.informed);
    fit.covariance(2, 2) = share * variance_chi;
    J_chi_m = share / sums.S * sums.B;
  } else if (sums.information > 0) {
    fit.point.z() = sums.informed / sums.information;
    fit.covariance(2, 2) = 1 / sums.information;
  } else {
    return fit;
  }
  fit.covariance.topLeftCorner<2, 2>().diagonal().setConstant(sigma2);
  fit.covariance.topRightCorner<2, 1>() = sigma2 * J_chi_m;
  fit.covariance.bottomLeftCorner<1, 2>() = sigma2 * J_chi_m.transpose();
  fit.degeneracy = degeneracyOf(fit);
  return fit;
}

WindowFit fitMaximumLikelihood(const WindowImages& images) {
  WindowFit fit = fitLeastSquares(images);
  if (!isStart(fit)) return fit;
  fit.degeneracy = iterate(fit, images, Weighting::none, kGaussNewtonSteps);
  finish(fit, images, Weighting::none);
  return fit;
}

WindowFit fitRobustly(const WindowImages& images) {
  WindowFit fit = fitLeastSquares(images);
  if (!isStart(fit)) return fit;
  fit.degeneracy = iterate(fit, images, Weighting::huber, kHuberSteps);
  if (fit.degeneracy == WindowDegeneracy::none) {
    fit.degeneracy = iterate(fit, images, Weighting::tukey, kTukeySteps);
  }
  finish(fit, images, Weighting::tukey);
  return fit;
}

}  // namespace depthservo
