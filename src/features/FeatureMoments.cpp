#include "depthservo/features/FeatureMoments.h"

#include <visp3/core/vpFeatureDisplay.h>

#include <cmath>
#include <iostream>

#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

/// Sums over the points about their barycentre.
struct CentralMoments {
  double xg = 0, yg = 0;
  double mu20 = 0, mu11 = 0, mu02 = 0, mu30 = 0, mu21 = 0, mu12 = 0, mu03 = 0;
};

template <typename PointAt>
CentralMoments centralMoments(std::size_t count, const PointAt& pointAt) {
  CentralMoments m;
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = pointAt(i);
    m.xg += p.x;
    m.yg += p.y;
  }
  m.xg /= static_cast<double>(count);
  m.yg /= static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = pointAt(i);
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

}  // namespace

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
  plane_ = {};
  L_.setZero();
}

FeatureMoments* FeatureMoments::duplicate() const { return new FeatureMoments(*this); }

double FeatureMoments::scaleFor(const std::vector<PointState>& points, double value) {
  FeatureMoments moments(1);
  moments.buildFrom(points);
  return value * std::sqrt(moments.area());
}

void FeatureMoments::buildFrom(const std::vector<PointState>& points) {
  plane_.buildFrom(points);
  compute(points);
}

void FeatureMoments::update(const PointFeatures& points) {
  plane_.update(points);
  compute(points);
}

void FeatureMoments::update(const std::vector<DepthEstimate>& points) {
  plane_.update(points);
  compute(points);
}

template <typename Points>
void FeatureMoments::compute(const Points& points) {
  if (!plane_.isKnown()) return;
  const CentralMoments m = centralMoments(
      points.size(), [&](std::size_t i) { return ObservedPlane::sampleOf(points[i]); });
  const double a = m.mu20 + m.mu02, n = static_cast<double>(points.size());
  area_ = a;
  const auto& [xg, yg, mu20, mu11, mu02, mu30, mu21, mu12, mu03] = m;
  const double A = plane()[0], B = plane()[1], C = plane()[2], chi = plane_.chiAt(xg, yg);
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
  std::cout << " Z=" << Z() << " (plane " << toString(planeStatus()) << ")" << std::endl;
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
