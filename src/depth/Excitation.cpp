#include "depthservo/depth/Excitation.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Sine of the angle between motion and line of sight below which a camera moves along it.
constexpr double kAlong = 0.1;

/// Speeds [m/s, rad/s] beyond which a motion is nonsense.
constexpr double kLargestSpeed = 1e9;

double root(double square) { return std::sqrt(std::max(0.0, square)); }

}  // namespace

std::string describe(Hindrance hindrance, int point) {
  const std::string name = "point " + std::to_string(point);
  switch (hindrance) {
    case Hindrance::none:
      return "";
    case Hindrance::noMotion:
      return "no motion";
    case Hindrance::noTranslation:
      return "no translation";
    case Hindrance::alongLineOfSight:
      return "moving along the line of sight of " + name;
    case Hindrance::tooSlow:
      return "too little motion across the line of sight of " + name;
    case Hindrance::noRotation:
      return "no rotation";
    case Hindrance::opticalAxisOnly:
      return "rotation about the optical axis only";
    case Hindrance::radialOnly:
      return "rotation moves " + name + " only to and from the middle of the image";
  }
  return "";
}

Excitation::Excitation() : Excitation(Options()) {}

Excitation::Excitation(const Options& options) : options_(options) {}

void Excitation::add(const Motion& motion) {
  if (!motion.isUsable()) return;
  const Twist u = motion.twist();
  const double size = u.linear.lpNorm<1>() + u.angular.lpNorm<1>();
  if (!(size < kLargestSpeed)) return;
  const double seen = -std::expm1(-motion.dt / options_.window_s);
  linear_ += seen * (u.linear * u.linear.transpose() - linear_);
  angular_ += seen * (u.angular * u.angular.transpose() - angular_);
  filled_ += seen * (1 - filled_);
}

double Excitation::speed() const { return filled_ > 0 ? root(linear_.trace() / filled_) : 0; }

double Excitation::turnRate() const { return filled_ > 0 ? root(angular_.trace() / filled_) : 0; }

double Excitation::across(double x, double y) const {
  if (!(filled_ > 0)) return 0;
  const Eigen::Vector3d a(-1, 0, x), b(0, -1, y);
  return root((a.dot(linear_ * a) + b.dot(linear_ * b)) / filled_);
}

Hindrance Excitation::ofDepth(double x, double y) const {
  if (speed() < options_.speed) {
    return turnRate() < options_.turnRate ? Hindrance::noMotion : Hindrance::noTranslation;
  }
  // |Omega| of a motion across the line of sight is at least the speed.
  return across(x, y) < kAlong * speed() ? Hindrance::alongLineOfSight : Hindrance::tooSlow;
}

Hindrance Excitation::ofFocal(double x, double y) const {
  if (turnRate() < options_.turnRate) {
    return speed() < options_.speed ? Hindrance::noMotion : Hindrance::noRotation;
  }
  const double tilting2 = angular_(0, 0) + angular_(1, 1);
  if (root(tilting2 / filled_) < options_.turnRate || tilting2 < kAlong * kAlong * angular_(2, 2)) {
    return Hindrance::opticalAxisOnly;
  }
  // eta1 = y1 wx + y2 wy is what moves the point sideways.
  const Eigen::Vector2d p(x, y);
  const double eta1_2 = p.dot(angular_.topLeftCorner<2, 2>() * p);
  return eta1_2 < kAlong * kAlong * p.squaredNorm() * tilting2 ? Hindrance::radialOnly
                                                               : Hindrance::tooSlow;
}

}  // namespace depthservo
