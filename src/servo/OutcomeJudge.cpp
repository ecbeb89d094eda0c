#include "servo/OutcomeJudge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

constexpr double kHold_s = 2;        // the error stays within tolerance this long: converged
constexpr double kStall_s = 5;       // no progress for this long: stalled. That is,
constexpr double kStallWay_m = 0.1;  // the robot has hardly moved from where it was
constexpr double kStallTurn_rad = 0.1;
constexpr double kStallGain = 0.02;    // and the error has not become smaller by this fraction
constexpr double kMean_s = 1;          // errors are compared as means over this time
constexpr double kLost_s = 1;          // a feature is lost this long
constexpr double kDivergence = 3;      // times the first error, and
constexpr double kDivergence_px = 60;  // at least this much more
constexpr double kTimeSlack_s = 1e-6;

}  // namespace

OutcomeJudge::OutcomeJudge(const PinholeCamera& camera, double tolerance_px, double Z_min)
    : camera_(camera), tolerance_px_(tolerance_px), Z_min_(Z_min) {}

std::optional<OutcomeJudge::Verdict> OutcomeJudge::atExposure(
    const std::vector<World::TruePoint>& truth) const {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i].Z < Z_min_) {
      return Verdict{Outcome::collision, fmt::format("the camera came within {:.3g} m of dot {}",
                                                     std::max(truth[i].Z, 0.0), i)};
    }
    if (!camera_.contains(truth[i].u, truth[i].v)) {
      return Verdict{Outcome::leftImage, fmt::format("dot {} left the image at ({:.0f}, {:.0f}) px",
                                                     i, truth[i].u, truth[i].v)};
    }
  }
  return std::nullopt;
}

std::optional<OutcomeJudge::Verdict> OutcomeJudge::afterCommand(const RunLog& log,
                                                                bool isTracking) {
  const FrameRecord& frame = log.frames.back();
  if (!isTracking) {
    trackingSince_s_ = kUnknown;
    if (std::isnan(lostSince_s_)) lostSince_s_ = frame.time_s;
    if (frame.time_s - lostSince_s_ < kLost_s) return std::nullopt;
    return Verdict{Outcome::lost, fmt::format("a feature was lost for {:g} s", kLost_s)};
  }
  lostSince_s_ = kUnknown;
  if (std::isnan(trackingSince_s_)) trackingSince_s_ = frame.time_s;
  if (std::isnan(firstError_px_)) firstError_px_ = frame.error_px;
  if (frame.error_px > kDivergence * firstError_px_ + kDivergence_px) {
    return Verdict{Outcome::diverged, fmt::format("the image error grew from {:.1f} to {:.1f} px",
                                                  firstError_px_, frame.error_px)};
  }

  const double tracked_s = frame.time_s - trackingSince_s_ + kTimeSlack_s;
  const double error_px = meanImageError(log, frame.time_s - kHold_s, frame.time_s);
  if (tracked_s >= kHold_s && error_px < tolerance_px_) {
    return Verdict{Outcome::converged,
                   fmt::format("image error {:.2f} px rms over the last {:g} s, "
                               "tolerance {:g} px",
                               error_px, kHold_s, tolerance_px_)};
  }
  if (tracked_s >= kStall_s && !hasProgress(log)) {
    return Verdict{Outcome::stalled,
                   fmt::format("no progress for {:g} s with an image error of {:.1f} px rms",
                               kStall_s, error_px)};
  }
  return std::nullopt;
}

bool OutcomeJudge::hasProgress(const RunLog& log) const {
  const FrameRecord& last = log.frames.back();
  const double begin_s = last.time_s - kStall_s;
  const auto first = std::find_if(log.frames.rbegin(), log.frames.rend(), [&](const auto& frame) {
    return frame.time_s <= begin_s + kTimeSlack_s;
  });
  const Eigen::Vector3d way = last.robotPose - first->robotPose;
  const double before = meanImageError(log, begin_s, begin_s + kMean_s);
  const double now = meanImageError(log, last.time_s - kMean_s, last.time_s);
  return way.head<2>().norm() > kStallWay_m || std::abs(way.z()) > kStallTurn_rad ||
         now < (1 - kStallGain) * before;
}

}  // namespace depthservo
