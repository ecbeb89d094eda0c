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

std::optional<OutcomeJudge::Verdict> OutcomeJudge::afterCommand(const FrameRecord& frame,
                                                                bool isTracking) {
  if (!isTracking) {
    recent_.clear();
    if (std::isnan(lostSince_s_)) lostSince_s_ = frame.time_s;
    if (frame.time_s - lostSince_s_ < kLost_s) return std::nullopt;
    return Verdict{Outcome::lost, fmt::format("a feature was lost for {:.3g} s", kLost_s)};
  }
  lostSince_s_ = kUnknown;
  if (!std::isfinite(frame.error_px)) return std::nullopt;

  if (std::isnan(firstError_px_)) firstError_px_ = frame.error_px;
  if (frame.error_px > kDivergence * firstError_px_ + kDivergence_px) {
    return Verdict{Outcome::diverged, fmt::format("the image error grew from {:.1f} to {:.1f} px",
                                                  firstError_px_, frame.error_px)};
  }

  recent_.push_back({frame.time_s, frame.error_px, frame.robotPose});
  while (recent_.front().time_s < frame.time_s - kStall_s - kTimeSlack_s) recent_.pop_front();
  const double error_px = meanError(frame.time_s - kHold_s, frame.time_s);
  if (hasSeen(kHold_s) && error_px < tolerance_px_) {
    return Verdict{Outcome::converged,
                   fmt::format("image error {:.2f} px rms over the last {:g} s, "
                               "tolerance {:g} px",
                               error_px, kHold_s, tolerance_px_)};
  }
  if (hasSeen(kStall_s) && !hasProgress()) {
    return Verdict{Outcome::stalled,
                   fmt::format("no progress for {:g} s with an image error of {:.1f} px rms",
                               kStall_s, error_px)};
  }
  return std::nullopt;
}

bool OutcomeJudge::hasSeen(double period_s) const {
  return recent_.back().time_s - recent_.front().time_s >= period_s - kTimeSlack_s;
}

double OutcomeJudge::meanError(double from_s, double to_s) const {
  double sum = 0;
  int count = 0;
  for (const Step& step : recent_) {
    if (step.time_s < from_s - kTimeSlack_s || step.time_s > to_s + kTimeSlack_s) continue;
    sum += step.error_px;
    ++count;
  }
  return sum / count;
}

bool OutcomeJudge::hasProgress() const {
  const Step &first = recent_.front(), &last = recent_.back();
  const Eigen::Vector3d way = last.robotPose - first.robotPose;
  const double before = meanError(first.time_s, first.time_s + kMean_s);
  const double now = meanError(last.time_s - kMean_s, last.time_s);
  return way.head<2>().norm() > kStallWay_m || std::abs(way.z()) > kStallTurn_rad ||
         now < (1 - kStallGain) * before;
}

}  // namespace depthservo
