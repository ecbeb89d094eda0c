#include "depthservo/features/FeatureSegment.h"

#include <cmath>

#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

/// Ends nearer than this [-] have no direction: they are drawn apart.
constexpr double kShortest = 1e-6;

}  // namespace

void FeatureSegment::setErrors(const ErrorProfile& errors) {
  for (ObservedPoint& end : ends_) end.setErrors(errors);
}

void FeatureSegment::setNoise(double sigma_px, const vpCameraParameters& cam) {
  for (ObservedPoint& end : ends_) end.setNoise(sigma_px, cam);
}

void FeatureSegment::setServoDepth(ServoDepth choice) {
  for (ObservedPoint& end : ends_) end.setServoDepth(choice);
}

void FeatureSegment::setDesiredDepths(double Z1, double Z2) {
  ends_[0].setDesiredDepth(Z1);
  ends_[1].setDesiredDepth(Z2);
}

void FeatureSegment::follow(const Motion& motion) {
  const double scale = isNormalized() ? 1 / getL() : 1;
  const double half = isNormalized() ? scale / 2 : getL() / 2;
  const double dx = half * std::cos(getAlpha()), dy = half * std::sin(getAlpha());
  const double x = scale * getXc(), y = scale * getYc();
  const bool isNew = flags[0] && flags[1] && flags[2] && flags[3];
  ShownPoint end[2]{{x + dx, y + dy, getZ1(), isNew}, {x - dx, y - dy, getZ2(), isNew}};
  const ShownPoint before[2]{end[0], end[1]};
  bool isMoved = false;
  for (int i = 0; i < 2; ++i) {
    const auto k = static_cast<std::size_t>(i);
    ends_[k].observe(motion, end[i]);
    isMoved |= end[i].x != before[i].x || end[i].y != before[i].y;
  }
  const bool isObserved = ends_[0].isObserved() && ends_[1].isObserved();
  const bool isShort = !(std::hypot(end[0].x - end[1].x, end[0].y - end[1].y) > kShortest);
  if (isShort) {
    end[0].x += kShortest;
    end[1].x -= kShortest;
  }
  if (isMoved || isShort) {
    buildFrom(end[0].x, end[0].y, end[0].Z, end[1].x, end[1].y, end[1].Z);
  }
  showDepths(end[0].Z, end[1].Z);
  if (isObserved) resetFlags();
}

void FeatureSegment::showDepths(double Z1, double Z2) {
  if (Z1 != getZ1()) setZ1(Z1);
  if (Z2 != getZ2()) setZ2(Z2);
}

void FeatureSegment::forget() {
  ends_[0].reset(getZ1());
  ends_[1].reset(getZ2());
}

void FeatureSegment::makeUsable() {
  showDepths(ends_[0].usable(getZ1()), ends_[1].usable(getZ2()));
}

void FeatureSegment::meet(const vpBasicFeature& s_star) {
  const auto* desired = dynamic_cast<const vpFeatureSegment*>(&s_star);
  if (!desired) return;
  ends_[0].meetDesired(desired->getZ1());
  ends_[1].meetDesired(desired->getZ2());
}

void FeatureSegment::describe(std::ostream& out) const {
  if (!ends_[0].isObserved()) return;
  out << "Observed: Z1=" << estimate(0).Z() << " sigma_Z1=" << estimate(0).sigma_Z()
      << " Z2=" << estimate(1).Z() << " sigma_Z2=" << estimate(1).sigma_Z() << " ("
      << estimate(0).status << ", " << estimate(1).status << ")" << std::endl;
}

}  // namespace depthservo
