#include "depthservo/features/FeaturePoint.h"

#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpMeterPixelConversion.h>

#include <cstdio>

#include "depthservo/visp/using.h"
#include "features/hasStatedDepth.h"
#include "motion/DecimalPoint.h"

namespace depthservo {
namespace {

template <typename Pixel>
void displayDepth(const DepthEstimate& estimate, const vpCameraParameters& cam,
                  const vpImage<Pixel>& I, const vpColor& color) {
  vpImagePoint point;
  vpMeterPixelConversion::convertPoint(cam, estimate.x, estimate.y, point);
  const DecimalPoint decimal;
  char text[64];
  std::snprintf(text, sizeof text, "%.2f +- %.2f m", estimate.Z(), 2 * estimate.sigma_Z());
  vpDisplay::displayText(I, point + vpImagePoint(-10, 10), text, color);
}

}  // namespace

FeaturePoint::FeaturePoint(const DepthEstimator& estimator, const DepthRange& range) {
  point_ = ObservedPoint(estimator, range);
}

void FeaturePoint::follow(const Motion& motion) {
  if (!point_.estimator_) return;  // a member of a group is observed by its group
  ShownPoint point = shown();
  point_.observe(motion, point);
  show(point);
}

void FeaturePoint::publish(const DepthEstimate& estimate) {
  ShownPoint point = shown();
  point_.show(estimate, point);
  show(point);
}

void FeaturePoint::show(const ShownPoint& point) {
  if (point.x != s[0] || point.y != s[1]) {
    set_x(point.x);
    set_y(point.y);
  }
  if (point.Z != get_Z()) set_Z(point.Z);
  if (point_.isObserved()) resetFlags();
}

void FeaturePoint::setDepth(double depth, double sigma_depth) {
  if (point_.setDepth(depth, sigma_depth)) set_Z(point_.servoDepth());
}

void FeaturePoint::meet(const vpBasicFeature& s_star) {
  const auto* desired = dynamic_cast<const vpFeaturePoint*>(&s_star);
  if (desired && hasStatedDepth(*desired)) point_.meetDesired(desired->get_Z());
}

void FeaturePoint::describe(std::ostream& out) const {
  ObservingPointFeature::describe(out);
  if (!point_.isObserved()) return;
  if (unknownFor_s() > 0) {
    out << "The camera's motion is unknown for " << unknownFor_s() << " s: " << refused()
        << " twists could not be used" << std::endl;
  }
  if (depthsSet() > 0) {
    out << "Z was set before " << depthsSet() << " images; it started the depth anew " << restarts()
        << " times" << std::endl;
  }
}

void FeaturePoint::display(const vpCameraParameters& cam, const vpImage<unsigned char>& I,
                           const vpColor& color, unsigned int thickness) const {
  vpFeaturePoint::display(cam, I, color, thickness);
  if (point_.isObserved()) displayDepth(estimate(), cam, I, color);
}

void FeaturePoint::display(const vpCameraParameters& cam, const vpImage<vpRGBa>& I,
                           const vpColor& color, unsigned int thickness) const {
  vpFeaturePoint::display(cam, I, color, thickness);
  if (point_.isObserved()) displayDepth(estimate(), cam, I, color);
}

}  // namespace depthservo
