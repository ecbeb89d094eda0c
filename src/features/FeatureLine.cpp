#include "depthservo/features/FeatureLine.h"

#include <cmath>

#include "depthservo/visp/using.h"
#include "features/LineModel.h"
#include "features/ShapeFilter.h"

namespace depthservo {

struct FeatureLine::Filter : ShapeFilter<LineModel> {};

FeatureLine::FeatureLine() : filter_(std::make_unique<Filter>()) {}
FeatureLine::FeatureLine(const FeatureLine& other) : FeatureLine() { *this = other; }
FeatureLine::~FeatureLine() = default;

FeatureLine& FeatureLine::operator=(const FeatureLine& other) {
  if (this == &other) return *this;
  ObservingShapeFeature::operator=(other);
  *filter_ = *other.filter_;
  sigma_rho_ = other.sigma_rho_;
  sigma_theta_ = other.sigma_theta_;
  return *this;
}

void FeatureLine::forget() {
  filter_->forget();
  estimate_ = {};
  blend_.forget();
}

void FeatureLine::setErrors(const ErrorProfile& errors) { filter_->setErrors(errors); }

void FeatureLine::setNoise(double sigma_rho, double sigma_theta) {
  constexpr double kLargest = PointMeasurement::kLargestSigma;
  if (!(sigma_rho > 0 && sigma_rho <= kLargest && sigma_theta > 0 && sigma_theta <= kLargest)) return;
  sigma_rho_ = sigma_rho;
  sigma_theta_ = sigma_theta;
}

void FeatureLine::setABCD(double a, double b, double c, double d) {
  vpFeatureLine::setABCD(a, b, c, d);
  const double x = getRho() * std::cos(getTheta()), y = getRho() * std::sin(getTheta());
  filter_->setGuess(-d / (a * x + b * y + c));
}

void FeatureLine::buildFrom(double rho, double theta, double a, double b, double c, double d) {
  vpFeatureLine::buildFrom(rho, theta);
  FeatureLine::setABCD(a, b, c, d);
}

double FeatureLine::slope() const { return filter_->state()[3]; }
double FeatureLine::sigma_slope() const { return std::sqrt(filter_->covariance()(3, 3)); }

void FeatureLine::follow(const Motion& motion) {
  const Eigen::Vector2d seen(getRho(), getTheta());
  const bool isNew = flags[0] && flags[1] && seen.allFinite() &&
                     std::abs(seen[0]) <= PointMeasurement::kLargest && std::abs(seen[1]) < 1e6;
  const Eigen::Vector2d variance(sigma_rho_ * sigma_rho_, sigma_theta_ * sigma_theta_);
  filter_->predict(motion);
  if (isNew && motion.dt > 0) filter_->measure(seen, variance);
  if (!filter_->isStarted()) {
    if (!seen.allFinite()) setRhoTheta(0, 0);
    return;
  }
  estimate_ = filter_->estimate();
  if (!isNew || !filter_->isMeasured()) setRhoTheta(filter_->state()[0], filter_->state()[1]);
  showPlane();
  resetFlags();
}

/// The plane D = -1 that contains the line and is level across it, at the depth for the servo. A
/// slope counts as far as it is known.
void FeatureLine::showPlane() {
  const double chi = 1 / blend_.of(estimate_), known = estimate_.chi * estimate_.chi;
  const double variance = filter_->covariance()(3, 3), theta = getTheta();
  const bool isTurned = std::cos(theta - filter_->state()[1]) < 0;
  const double shown =
      (isTurned ? -1 : 1) * slope() * chi / estimate_.chi * known / (known + variance);
  vpFeatureLine::setABCD(-shown * std::sin(theta), shown * std::cos(theta), chi, -1);
}

void FeatureLine::update(const ObservedPlane& plane) {
  if (!plane.isKnown()) return;
  vpFeatureLine::setABCD(plane.abc()[0], plane.abc()[1], plane.abc()[2], -1);
}

void FeatureLine::describe(std::ostream& out) const {
  if (!isObserved()) return;
  out << "Observed: Z=" << estimate_.Z() << " sigma_Z=" << estimate_.sigma_Z()
      << " slope=" << slope() << " sigma_slope=" << sigma_slope() << " (" << estimate_.status << ")"
      << std::endl;
}

}  // namespace depthservo
