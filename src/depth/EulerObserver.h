#pragma once

#include <Eigen/Core>
#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/NonlinearDepthObserver.h"

namespace depthservo {

/// The observer of De Luca, Oriolo, Robuffo Giordano 2008 by Euler's method, as one would write it
/// from the paper: the state of image k + 1 from the measurement of image k and the twist between
/// both. It diverges at the rates of cameras; for comparison (`depth.euler`).
class DEPTHSERVO_INNER EulerObserver : public DepthEstimator {
 public:
  /// Omega: what a translation does to a point of inverse depth 1 1/m. \param p (x, y), normalised
  static Eigen::Vector2d Omega(const Twist& u, const Eigen::Vector2d& p);

  /// Eq. 11-14 as a differential equation: d(x, y, chi)/dt, with drift and Omega at the measured
  /// point.
  static Eigen::Vector3d rate(const ObserverGains& gains, const Twist& u,
                              const Eigen::Vector2d& measured, const Eigen::Vector3d& estimate);

  EulerObserver(const ObserverGains& gains, const DepthRange& range)
      : gains_(gains), range_(range) {}

  std::unique_ptr<DepthEstimator> clone() const override;
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override;
  void predict(const Motion& motion) override;
  void correct(const PointMeasurement& measurement) override;
  void correctDepth(const DepthPrior&) override {}
  DepthEstimate estimate() const override;

 private:
  ObserverGains gains_;
  DepthRange range_;
  Eigen::Vector2d measured_ = Eigen::Vector2d::Zero();
  Eigen::Vector3d estimated_ = Eigen::Vector3d::UnitZ();  // x, y, chi
};

}  // namespace depthservo
