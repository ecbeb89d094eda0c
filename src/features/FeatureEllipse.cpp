#include "depthservo/features/FeatureEllipse.h"

#include <cmath>

#include "depthservo/visp/using.h"
#include "features/EllipseModel.h"
#include "features/ShapeFilter.h"
#include "features/SphereModel.h"

namespace depthservo {
namespace {

/// Numbers that can be of what a camera sees.
bool areNear(const Eigen::Matrix<double, 5, 1>& s) {
  return s.allFinite() && s.cwiseAbs().maxCoeff() <= 1e3;
}

/// An ellipse that a camera can see, with an inside.
bool isEllipse(const Eigen::Matrix<double, 5, 1>& s) {
  return areNear(s) && s[2] > 1e-12 && s[4] > 1e-12 && s[2] * s[4] > s[3] * s[3];
}

/// Of the centre as told, of a moment a^2/4 as that of its semi-axis a.
EllipseModel::Measured varianceOf(const EllipseModel::Measured& s, double sigma) {
  const double r = sigma * sigma;
  return (EllipseModel::Measured() << r, r, r * s[2], r * (s[2] + s[4]) / 4, r * s[4]).finished();
}

}  // namespace

struct FeatureEllipse::Filters {
  ShapeFilter<EllipseModel> planar;
  ShapeFilter<SphereModel> sphere;
};

FeatureEllipse::FeatureEllipse(EllipseShape shape)
    : filters_(std::make_unique<Filters>()), shape_(shape) {}
FeatureEllipse::FeatureEllipse(const FeatureEllipse& other) : FeatureEllipse() { *this = other; }
FeatureEllipse::~FeatureEllipse() = default;

FeatureEllipse& FeatureEllipse::operator=(const FeatureEllipse& other) {
  if (this == &other) return *this;
  ObservingShapeFeature::operator=(other);
  *filters_ = *other.filters_;
  shape_ = other.shape_;
  abc_ = other.abc_;
  sigma_ = other.sigma_;
  return *this;
}

void FeatureEllipse::forget() {
  filters_->planar.forget();
  filters_->sphere.forget();
  estimate_ = {};
  blend_.forget();
  abc_ = Eigen::Vector3d::UnitZ();
}

void FeatureEllipse::setErrors(const ErrorProfile& errors) {
  filters_->planar.setErrors(errors);
  filters_->sphere.setErrors(errors);
}

void FeatureEllipse::setNoise(double sigma_px, const vpCameraParameters& cam) {
  const double sigma = sigma_px / std::sqrt(std::abs(cam.get_px() * cam.get_py()));
  if (sigma > 0 && sigma <= PointMeasurement::kLargestSigma) sigma_ = sigma;
}

void FeatureEllipse::setABC(double a, double b, double c) {
  vpFeatureEllipse::setABC(a, b, c);
  abc_ << a, b, c;
  const double Z = 1 / (a * get_x() + b * get_y() + c);
  filters_->planar.setGuess(Z);
  filters_->sphere.setGuess(Z);
}

void FeatureEllipse::buildFrom(double x, double y, double n20, double n11, double n02, double a,
                               double b, double c) {
  vpFeatureEllipse::buildFrom(x, y, n20, n11, n02);
  FeatureEllipse::setABC(a, b, c);
}

void FeatureEllipse::step(const Motion& motion, const Seen& seen, bool isNew) {
  const auto advance = [&](auto& filter, const auto& z, const auto& variance) {
    filter.predict(motion);
    if (isNew) filter.measure(z, variance);
    if (filter.isStarted()) estimate_ = filter.estimate();
  };
  if (shape_ == EllipseShape::planar) {
    advance(filters_->planar, seen, varianceOf(seen, sigma_));
  } else {
    const Eigen::Vector3d variance = Eigen::Vector3d::Constant(sigma_ * sigma_);
    advance(filters_->sphere, isNew ? SphereModel::ofEllipse(seen) : Eigen::Vector3d::Zero().eval(),
            variance);
  }
}

void FeatureEllipse::follow(const Motion& motion) {
  const Seen seen = (Seen() << get_x(), get_y(), get_n20(), get_n11(), get_n02()).finished();
  const bool isNew = flags[0] && flags[1] && flags[2] && flags[3] && flags[4] && isEllipse(seen);
  if (motion.dt > 0) step(motion, seen, isNew);
  if (!isObserved()) {
    if (!seen.allFinite()) vpFeatureEllipse::buildFrom(0, 0, 0, 0, 0);
    return;
  }
  const bool isMeasured = shape_ == EllipseShape::planar ? filters_->planar.isMeasured()
                                                         : filters_->sphere.isMeasured();
  if (!isNew || !isMeasured) {
    const Seen at = predicted();
    if (isEllipse(at)) vpFeatureEllipse::buildFrom(at[0], at[1], at[2], at[3], at[4]);
  }
  if (!areNear(seen) && !isEllipse(predicted())) vpFeatureEllipse::buildFrom(0, 0, 0, 0, 0);
  showPlane();
  resetFlags();
}

FeatureEllipse::Seen FeatureEllipse::predicted() const {
  if (shape_ == EllipseShape::planar) return filters_->planar.state().head<5>();
  return SphereModel::toEllipse(filters_->sphere.state());
}

/// The plane at the depth for the servo; its tilt counts as far as it is known.
void FeatureEllipse::showPlane() {
  const double chi = 1 / blend_.of(estimate_);
  if (shape_ == EllipseShape::sphere) {
    abc_ = SphereModel::plane(filters_->sphere.state(), chi);
  } else {
    const auto& x = filters_->planar.state();
    const double known = estimate_.chi * estimate_.chi;
    const double variance = filters_->planar.covariance().diagonal().segment<2>(5).sum() / 2;
    const Eigen::Vector2d tilt = x.segment<2>(5) * chi / estimate_.chi * known / (known + variance);
    abc_ << tilt, chi - tilt.dot(x.head<2>());
  }
  if (!abc_.allFinite()) abc_ << 0, 0, chi;
  vpFeatureEllipse::setABC(abc_[0], abc_[1], abc_[2]);
}

void FeatureEllipse::update(const ObservedPlane& plane) {
  if (!plane.isKnown()) return;
  abc_ = plane.abc();
  vpFeatureEllipse::setABC(abc_[0], abc_[1], abc_[2]);
}

}  // namespace depthservo
