#pragma once

#include <optional>
#include <string>

#include "depthservo/observation/RunLog.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// Judges the frame rate that a running `pose` estimator meets by the conditions for its gain.
class FrameRateMonitor {
 public:
  explicit FrameRateMonitor(const EstimatorSetup& setup);

  /// Looks at the lowest rate met so far; what is now to be said, if anything. Does nothing for
  /// other estimators.
  std::optional<std::string> update(const PointSetEstimator& estimator);

  /// None before the second image.
  const std::optional<FrameRateReport>& report() const { return report_; }

 private:
  double ke_, kappa_;
  std::optional<double> kc_;
  bool isGuarded_;
  std::optional<FrameRateReport> report_;
};

}  // namespace depthservo
