#include "servo/SpeedGovernor.h"

#include <algorithm>

namespace depthservo {
namespace {

/// The command fades from full speed to a stop, or back, within this time [s].
constexpr double kRamp_s = 0.5;

/// Share of the command below which the robot stops for hidden points: slower, it would hardly get
/// on.
constexpr double kLeastSpeed = 0.1;

bool isLost(const DepthEstimate& estimate) {
  return estimate.status == DepthStatus::unset || estimate.status == DepthStatus::lost;
}

}  // namespace

const char* toString(Basis basis) {
  switch (basis) {
    case Basis::nothing:
      return "lost: the command fades out";
    case Basis::waiting:
      return "hidden points are predicted too vaguely: the robot waits";
    case Basis::slowed:
      return "hidden points are predicted vaguely: the robot slows down";
    case Basis::features:
      return "full speed";
  }
  return "";
}

double SpeedGovernor::allowedSpeed(const PointFeatures& features,
                                   const std::vector<PointObservation>& measured) const {
  double sigma_px = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const DepthEstimate& estimate = features[i].estimate();
    if (isLost(estimate)) return 0;
    const bool isMeasured =
        std::any_of(measured.begin(), measured.end(),
                    [&](const PointObservation& point) { return point.id == static_cast<int>(i); });
    if (!isMeasured) sigma_px = std::max(sigma_px, estimate.sigma_xy * focal_px_);
  }
  const double speed = std::min(1.0, 2 - 2 * sigma_px / hiddenSigma_px_);
  return speed < kLeastSpeed ? 0 : speed;
}

void SpeedGovernor::update(double time_s, const PointFeatures& features,
                           const std::vector<PointObservation>& measured) {
  const double allowed = allowedSpeed(features, measured);
  bool anyLost = false;
  for (std::size_t i = 0; i < features.size(); ++i) anyLost |= isLost(features[i].estimate());
  basis_ = anyLost        ? Basis::nothing
           : allowed == 0 ? Basis::waiting
           : allowed < 1  ? Basis::slowed
                          : Basis::features;
  const double elapsed_s = last_s_ < 0 ? 0 : std::max(0., time_s - last_s_);
  last_s_ = time_s;
  speed_ = std::clamp(allowed, speed_ - elapsed_s / kRamp_s, speed_ + elapsed_s / kRamp_s);
}

}  // namespace depthservo
