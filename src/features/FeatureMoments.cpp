#include "depthservo/features/FeatureMoments.h"

#include <visp3/core/vpFeatureDisplay.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iostream>

#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

/// Points whose rms width is below this part of their rms length are a line: the noise of their
/// depths would decide how the plane is tilted about it.
constexpr double kThinnest = 0.02;

/// Of the rms distance from the barycentre [-]: below, the points coincide.
constexpr double kSmallestSize = 1e-9;

/// Sigma of an inverse depth [1/m] below which one point does not count more than another.
constexpr double kSmallestSigma_chi = 1e-12;

struct WeightedPoint {
  double x, y, chi, weight;
};

WeightedPoint weighted(double x, double y, double chi, double sigma_chi) {
  const double sigma = std::max(sigma_chi, kSmallestSigma_chi);
  return {x, y, chi, 1 / (sigma * sigma)};
}

/// Sums over the points about their barycentre.
struct CentralMoments {
  double xg = 0, yg = 0;
  double mu20 = 0, mu11 = 0, mu02 = 0, mu30 = 0, mu21 = 0, mu12 = 0, mu03 = 0;
};

template <typename PointAt>
CentralMoments centralMoments(std::size_t count, const PointAt& pointAt) {
  CentralMoments m;
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPoint p = pointAt(i);
    m.xg += p.x;
    m.yg += p.y;
  }
  m.xg /= static_cast<double>(count);
  m.yg /= static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPoint p = pointAt(i);
    const double x = p.x - m.xg, y = p.y - m.yg;
    const double xx = x * x, yy = y * y;
    m.mu20 += xx;
    m.mu11 += x * y;
    m.mu02 += yy;
    m.mu30 += xx * x;
    m.mu21 += xx * y;
    m.mu12 += x * yy;
    m.mu03 += yy * y;
  }
  return m;
}

struct Plane {
  Eigen::Vector3d abc;
  MomentsPlane status;
};

/// chi = A x + B y + C by weighted least squares about the weighted barycentre.
template <typename PointAt>
Plane fitPlane(std::size_t count, const PointAt& pointAt) {
  double sum = 0, x0 = 0, y0 = 0, chi0 = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPoint p = pointAt(i);
    sum += p.weight;
    x0 += p.weight * p.x;
    y0 += p.weight * p.y;
    chi0 += p.weight * p.chi;
  }
  x0 /= sum;
  y0 /= sum;
  chi0 /= sum;
  Eigen::Matrix2d S = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPoint p = pointAt(i);
    const Eigen::Vector2d d(p.x - x0, p.y - y0);
    S += p.weight / sum * d * d.transpose();
    b += p.weight / sum * d * (p.chi - chi0);
  }
  const Plane facing{{0, 0, chi0}, MomentsPlane::frontoParallel};
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(S, Eigen::EigenvaluesOnly);
  const Eigen::Vector2d spread = eigen.eigenvalues();
  if (!(spread[0] > kThinnest * kThinnest * spread[1])) return facing;
  const Eigen::Vector2d ab = S.inverse() * b;
  const Plane fitted{{ab.x(), ab.y(), chi0 - ab.x() * x0 - ab.y() * y0}, MomentsPlane::fitted};
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPoint p = pointAt(i);
    if (!(fitted.abc.dot(Eigen::Vector3d(p.x, p.y, 1)) > 0)) return facing;
  }
  return fitted;
}

}  // namespace

const char* toString(MomentsPlane plane) {
  switch (plane) {
    case MomentsPlane::unset:
      return "unset";
    case MomentsPlane::fitted:
      return "fitted";
    case MomentsPlane::frontoParallel:
      return "fronto-parallel";
    case MomentsPlane::unusable:
      return "unusable";
  }
  return "";
}

FeatureMoments::FeatureMoments(double scale)
    : scale_(scale > 0 && std::isfinite(scale) ? scale : 1) {
  init();
}

FeatureMoments::FeatureMoments(const FeatureMoments& other) : FeatureMoments(other.scale_) {
  *this = other;
}

FeatureMoments& FeatureMoments::operator=(const FeatureMoments& other) {
  if (this == &other) return *this;
  vpBasicFeature::operator=(other);
  deallocate = user;  // this object belongs to whoever declared it, whoever owned the other
  scale_ = other.scale_;
  area_ = other.area_;
  plane_ = other.plane_;
  status_ = other.status_;
  L_ = other.L_;
  return *this;
}

void FeatureMoments::init() {
  dim_s = 3;
  nbParameters = 3;
  if (!flags) flags = new bool[nbParameters];
  for (unsigned i = 0; i < nbParameters; ++i) flags[i] = false;
  s.resize(dim_s);
  s = 0;
  area_ = 0;
  plane_ = Eigen::Vector3d::UnitZ();
  status_ = MomentsPlane::unset;
  L_.setZero();
}

FeatureMoments* FeatureMoments::duplicate() const { return new FeatureMoments(*this); }

double FeatureMoments::scaleFor(const std::vector<PointState>& points, double value) {
  FeatureMoments moments(1);
  moments.buildFrom(points);
  return value * std::sqrt(moments.area());
}

void FeatureMoments::buildFrom(const std::vector<PointState>& points) {
  compute(points.size(), [&](std::size_t i) -> WeightedPoint {
    return {points[i].x, points[i].y, points[i].chi, 1};
  });
}

void FeatureMoments::update(const PointFeatures& points) {
  compute(points.size(), [&](std::size_t i) {
    const FeaturePoint& p = points[i];
    return weighted(p.get_x(), p.get_y(), 1 / p.get_Z(), p.estimate().sigma_chi);
  });
}

void FeatureMoments::update(const std::vector<DepthEstimate>& points) {
  compute(points.size(), [&](std::size_t i) {
    const DepthEstimate& p = points[i];
    return weighted(p.x, p.y, p.chi, p.sigma_chi);
  });
}

template <typename PointAt>
void FeatureMoments::compute(std::size_t count, const PointAt& pointAt) {
  const CentralMoments m = centralMoments(count, pointAt);
  const double a = m.mu20 + m.mu02;
  const Plane fit = fitPlane(count, pointAt);
  const double n = static_cast<double>(count);
  if (!(a > n * kSmallestSize * kSmallestSize) || !std::isfinite(a) || !fit.abc.allFinite()) {
    if (status_ != MomentsPlane::unset) status_ = MomentsPlane::unusable;
    return;
  }
  plane_ = fit.abc;
  status_ = fit.status;
  area_ = a;
  const auto& [xg, yg, mu20, mu11, mu02, mu30, mu21, mu12, mu03] = m;
  const double A = plane_[0], B = plane_[1], C = plane_[2], chi = A * xg + B * yg + C;
  const double m20 = mu20 / n + xg * xg, m11 = mu11 / n + xg * yg, m02 = mu02 / n + yg * yg;
  L_.row(0) << -chi, 0, A * m20 + B * m11 + C * xg, m11, -(1 + m20), yg;
  L_.row(1) << 0, -chi, A * m11 + B * m02 + C * yg, 1 + m02, -m11, -xg;
  const double size = scale_ / std::sqrt(a);
  const double byArea = -size / a;  // 2 d(size)/da
  L_.row(2) << byArea * -(A * mu20 + B * mu11), byArea * -(A * mu11 + B * mu02),
      byArea * (chi * a + A * (xg * mu20 + yg * mu11 + mu30 + mu12) +
                B * (xg * mu11 + yg * mu02 + mu21 + mu03)),
      byArea * (xg * mu11 + yg * mu20 + 2 * yg * mu02 + mu21 + mu03),
      -byArea * (2 * xg * mu20 + xg * mu02 + yg * mu11 + mu30 + mu12), 0;
  s[0] = xg;
  s[1] = yg;
  s[2] = size;
  setFlags();
}

vpMatrix FeatureMoments::interaction(unsigned int select) {
  unsigned rows = 0;
  for (unsigned i = 0; i < dim_s; ++i) rows += (FEATURE_LINE[i] & select) != 0;
  vpMatrix L(rows, 6);
  for (unsigned i = 0, row = 0; i < dim_s; ++i) {
    if (!(FEATURE_LINE[i] & select)) continue;
    for (unsigned j = 0; j < 6; ++j) L[row][j] = L_(i, j);
    ++row;
  }
  return L;
}

void FeatureMoments::print(unsigned int select) const {
  const char* const names[] = {"xg", "yg", "size"};
  std::cout << "Moments:";
  for (unsigned i = 0; i < dim_s; ++i) {
    if (FEATURE_LINE[i] & select) std::cout << ' ' << names[i] << '=' << s[i];
  }
  std::cout << " Z=" << Z() << " (plane " << toString(status_) << ")" << std::endl;
}

void FeatureMoments::display(const vpCameraParameters& cam, const vpImage<unsigned char>& I,
                             const vpColor& color, unsigned int thickness) const {
  vpFeatureDisplay::displayPoint(s[0], s[1], cam, I, color, thickness);
}

void FeatureMoments::display(const vpCameraParameters& cam, const vpImage<vpRGBa>& I,
                             const vpColor& color, unsigned int thickness) const {
  vpFeatureDisplay::displayPoint(s[0], s[1], cam, I, color, thickness);
}

}  // namespace depthservo
