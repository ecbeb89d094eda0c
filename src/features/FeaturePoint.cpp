#include "depthservo/features/FeaturePoint.h"

#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpMeterPixelConversion.h>

#include <cstdio>
#include <iostream>

#include "depthservo/visp/using.h"
#include "features/hasStatedDepth.h"
#include "features/toTwist.h"

namespace depthservo {
namespace {

template <typename Pixel>
void displayDepth(const DepthEstimate& estimate, const vpCameraParameters& cam,
                  const vpImage<Pixel>& I, const vpColor& color) {
  vpImagePoint point;
  vpMeterPixelConversion::convertPoint(cam, estimate.x, estimate.y, point);
  char text[64];
  std::snprintf(text, sizeof text, "%.2f +- %.2f m", estimate.Z(), 2 * estimate.sigma_Z());
  vpDisplay::displayText(I, point + vpImagePoint(-10, 10), text, color);
}

}  // namespace

FeaturePoint::FeaturePoint(const DepthEstimator& estimator, const DepthRange& range)
    : point_(estimator, range) {}

FeaturePoint::FeaturePoint(const FeaturePoint& other) : FeaturePoint() { *this = other; }

FeaturePoint& FeaturePoint::operator=(const FeaturePoint& other) {
  if (this == &other) return *this;
  vpFeaturePoint::operator=(other);
  deallocate = user;  // this object belongs to whoever declared it, whoever owned the other
  for (unsigned i = 0; i < nbParameters; ++i) flags[i] = other.flags[i];
  point_ = other.point_;
  interactionAsked_ = other.interactionAsked_;
  depthUnused_ = other.depthUnused_;
  motion_ = other.motion_;
  return *this;
}

void FeaturePoint::init() {
  vpFeaturePoint::init();
  point_.reset(get_Z());
  interactionAsked_ = depthUnused_ = false;
  motion_ = {};
}

FeaturePoint* FeaturePoint::duplicate() const { return new FeaturePoint(*this); }

void FeaturePoint::observe(const vpColVector& twist, double dt) { observe(toMotion(twist, dt)); }

void FeaturePoint::observe(const Motion& told) {
  const Motion motion = motion_.take(told);
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

vpMatrix FeaturePoint::interaction(unsigned int select) {
  interactionAsked_ = true;
  const double usable = point_.usable(get_Z());
  if (usable != get_Z()) set_Z(usable);
  setFlags();  // so that ViSP's debug builds do not warn about a Z that was observed, not set
  return vpFeaturePoint::interaction(select);
}

vpColVector FeaturePoint::error(const vpBasicFeature& s_star, unsigned int select) {
  depthUnused_ = !interactionAsked_;
  interactionAsked_ = false;
  const auto* desired = dynamic_cast<const vpFeaturePoint*>(&s_star);
  if (desired && hasStatedDepth(*desired)) point_.meetDesired(desired->get_Z());
  return vpFeaturePoint::error(s_star, select);
}

void FeaturePoint::print(unsigned int select) const {
  vpFeaturePoint::print(select);
  if (!point_.isObserved()) return;
  std::cout << "Observed: Z=" << estimate().Z() << " sigma_Z=" << estimate().sigma_Z() << " ("
            << estimate().status << ")" << std::endl;
  if (unknownFor_s() > 0) {
    std::cout << "The camera's motion is unknown for " << unknownFor_s() << " s: " << refused()
              << " twists could not be used" << std::endl;
  }
  if (depthsSet() > 0) {
    std::cout << "Z was set before " << depthsSet() << " images; it started the depth anew "
              << restarts() << " times" << std::endl;
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
