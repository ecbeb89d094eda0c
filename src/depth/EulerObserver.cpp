#include "depth/EulerObserver.h"

namespace depthservo {

Eigen::Vector2d EulerObserver::Omega(const Twist& u, const Eigen::Vector2d& p) {
  return p * u.linear.z() - u.linear.head<2>();
}

Eigen::Vector3d EulerObserver::rate(const ObserverGains& gains, const Twist& u,
                                    const Eigen::Vector2d& measured,
                                    const Eigen::Vector3d& estimate) {
  const double x = measured.x(), y = measured.y(), chi = estimate.z();
  const Eigen::Vector3d& w = u.angular;
  const Eigen::Vector2d W = Omega(u, measured);
  const Eigen::Vector2d drift(x * y * w.x() - (1 + x * x) * w.y() + y * w.z(),
                              (1 + y * y) * w.x() - x * y * w.y() - x * w.z());
  const Eigen::Vector2d e = measured - estimate.head<2>();
  Eigen::Vector3d rate;
  rate.head<2>() = drift + W * chi + gains.k * e;
  rate.z() = chi * chi * u.linear.z() + chi * (y * w.x() - x * w.y()) + gains.k_3 * W.dot(e);
  return rate;
}

std::unique_ptr<DepthEstimator> EulerObserver::clone() const {
  return std::make_unique<EulerObserver>(*this);
}

void EulerObserver::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  measured_ << measurement.x, measurement.y;
  estimated_ << measured_, range_.clampChi(1 / prior.Z);
}

void EulerObserver::predict(const Motion& motion) {
  const Eigen::Vector3d next =
      estimated_ + motion.dt * rate(gains_, motion.twist(), measured_, estimated_);
  if (!next.allFinite()) return;
  estimated_ << next.head<2>(), range_.clampChi(next.z());
}

void EulerObserver::correct(const PointMeasurement& measurement) {
  measured_ << measurement.x, measurement.y;
}

DepthEstimate EulerObserver::estimate() const {
  DepthEstimate e;
  e.x = measured_.x();
  e.y = measured_.y();
  e.chi = estimated_.z();
  e.status = DepthStatus::converging;
  return e;
}

}  // namespace depthservo
