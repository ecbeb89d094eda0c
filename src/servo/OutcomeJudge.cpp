#include "servo/OutcomeJudge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "observation/imageError.h"

namespace depthservo {
namespace {

constexpr double kHold_s =
    kImageErrorOver_s;               // the error stays within tolerance this long: converged
constexpr double kStall_s = 5;       // no progress for this long: stalled. That is,
constexpr double kStallWay_m = 0.1;  // the robot has hardly moved from where it was
constexpr double kStallTurn_rad = 0.1;
constexpr double kStallGain = 0.02;    // and the error has not become smaller by this fraction
constexpr double kMean_s = 1;          // errors are compared as means over this time
constexpr double kLost_s = 1;          // a feature is lost this long
constexpr double kDivergence = 3;      // times the first error, and
constexpr double kDivergence_px = 60;  // at least this much more
constexpr std::size_t kNeeded = 3;  // points determine the pose of a camera; fewer in the image for
constexpr double kAway_s = 2;       // this long: it has left the image
constexpr double kTimeSlack_s = 1e-6;
constexpr double kRounding_px = 1e-6;  // of errors that are summed as they come

}  // namespace

const double OutcomeJudge::kLooksBack_s = std::max(kHold_s, kStall_s) + kMean_s;

OutcomeJudge::OutcomeJudge(const PinholeCamera& camera, const ControlOptions& control, double Z_min,
                           std::size_t points, const char* noun)
    : camera_(camera),
      tolerance_px_(control.tolerance),
      Z_min_(Z_min),
      wait_s_(control.hidden_wait),
      allInImage_(control.all_in_image),
      needed_(std::min(kNeeded, points)),
      noun_(noun) {}

void OutcomeJudge::restart() {
  firstError_px_ = kUnknown;
  tracking_ = unhindered_ = lost_ = waiting_ = away_ = {};
}

bool OutcomeJudge::Since::lasts(double duration_s, double time_s) const {
  return time_s - begin_s_ + kTimeSlack_s >= duration_s;
}

OutcomeJudge::Verdict OutcomeJudge::leftImage(const char* what) const {
  return {Outcome::leftImage, fmt::format("{} {} left the image at ({:.0f}, {:.0f}) px {}", noun_,
                                          *outside_, outsideAt_.u, outsideAt_.v, what)};
}

std::optional<OutcomeJudge::Verdict> OutcomeJudge::atExposure(double time_s,
                                                              const std::vector<TruePoint>& truth) {
  std::size_t inside = 0;
  std::optional<std::size_t> outside;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i].Z < Z_min_) {
      return Verdict{Outcome::collision, fmt::format("the camera came within {:.3g} m of {} {}",
                                                     std::max(truth[i].Z, 0.0), noun_, i)};
    }
    const bool isInside = camera_.contains(truth[i].u, truth[i].v);
    if (isInside) ++inside;
    if (!isInside && (!outside || outside_ == i)) outside = i;
  }
  if (outside && outside != outside_) outsideAt_ = truth[*outside];
  outside_ = outside;
  if (outside_ && allInImage_) return leftImage("(control.all_in_image)");
  away_.update(inside < needed_, time_s);
  if (!away_.lasts(kAway_s, time_s)) return std::nullopt;
  return leftImage(
      fmt::format("and fewer than {} were in it for {:g} s", needed_, kAway_s).c_str());
}

std::optional<OutcomeJudge::Verdict> OutcomeJudge::afterCommand(const RunLog& log, Basis basis) {
  const FrameRecord& frame = log.frames.back();
  const double now_s = frame.time_s;
  tracking_.update(basis == Basis::features || basis == Basis::slowed, now_s);
  unhindered_.update(basis == Basis::features, now_s);
  waiting_.update(basis == Basis::waiting, now_s);
  lost_.update(basis == Basis::nothing, now_s);
  if (basis == Basis::nothing) {
    if (!lost_.lasts(kLost_s, now_s)) return std::nullopt;
    if (outside_) return leftImage("and could not be predicted any longer");
    return Verdict{Outcome::lost, fmt::format("a feature was lost for {:g} s", kLost_s)};
  }
  if (basis == Basis::waiting) {
    if (outside_ && waiting_.lasts(kAway_s, now_s)) {
      return leftImage("and is predicted too vaguely to go on");
    }
    if (!waiting_.lasts(wait_s_, now_s)) return std::nullopt;
    return Verdict{
        Outcome::lost,
        fmt::format("points are hidden and predicted too vaguely to go on; waited {:g} s "
                    "for them (control.hidden_sigma, control.hidden_wait)",
                    wait_s_)};
  }
  if (std::isnan(firstError_px_)) firstError_px_ = frame.error_px;
  if (frame.error_px > kDivergence * firstError_px_ + kDivergence_px) {
    return Verdict{Outcome::diverged, fmt::format("the image error grew from {:.1f} to {:.1f} px",
                                                  firstError_px_, frame.error_px)};
  }

  const auto error = [&] { return meanImageError(log, frame.time_s - kHold_s, frame.time_s); };
  /// A mean over a whole swing is small: its last parts must be so, too.
  const auto isSteadySince = [&](double begin_s) {
    return imageErrorBeyondNoise(log, begin_s, now_s, 2) <= tolerance_px_;
  };
  const bool isFar = running_.follow(log) > tolerance_px_ + kRounding_px;
  const double error_px = !isFar && tracking_.lasts(kHold_s, now_s) ? error() : kUnknown;
  if (error_px < tolerance_px_ && isSteadySince(now_s - kHold_s / 2) &&
      isSteadySince(now_s - kHold_s / 4) && isSeen(log)) {
    return Verdict{Outcome::converged,
                   fmt::format("image error {:.2f} px rms over the last {:g} s, "
                               "tolerance {:g} px",
                               error_px, kHold_s, tolerance_px_)};
  }
  if (unhindered_.lasts(kStall_s, now_s) && !hasProgress(log) && isSeen(log)) {
    return Verdict{Outcome::stalled,
                   fmt::format("no progress for {:g} s with an image error of {:.1f} px rms",
                               kStall_s, error())};
  }
  return std::nullopt;
}

double OutcomeJudge::RunningError::follow(const RunLog& log) {
  const auto& frames = log.frames;
  const bool goesOn = frames_ > 0 && frames_ < frames.size() && sums_.size() == log.goals.size() &&
                      frames[frames.size() - 2].time_s == last_s_;
  if (!goesOn) {
    frames_ = 0;
    sums_.assign(log.goals.size(), Eigen::Vector2d::Zero());
    counts_.assign(log.goals.size(), 0);
  }
  last_s_ = frames.back().time_s;
  const double begin_s = last_s_ - kHold_s - kTimeSlack_s;
  const auto isIn = [&](std::size_t back) {
    return frames[frames.size() - back].time_s >= begin_s;
  };
  do {
    ++frames_;
    add(frames[frames.size() - (goesOn ? 1 : frames_)], log, 1);
  } while (!goesOn && frames_ < frames.size() && isIn(frames_ + 1));
  for (; frames_ > 1 && !isIn(frames_); --frames_) add(frames[frames.size() - frames_], log, -1);
  double squared = 0;
  int features = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    if (counts_[i] == 0) continue;
    squared += (sums_[i] / counts_[i]).squaredNorm();
    ++features;
  }
  if (std::isnan(squared)) frames_ = 0;  // a value that was none would stay
  return features > 0 ? std::sqrt(squared / features) : kUnknown;
}

void OutcomeJudge::RunningError::add(const FrameRecord& frame, const RunLog& log, int sign) {
  for (const FeatureRecord& feature : frame.features) {
    const auto i = static_cast<std::size_t>(feature.id);
    if (feature.id < 0 || i >= sums_.size()) continue;
    sums_[i] += sign * (Eigen::Vector2d(feature.u, feature.v) - log.goals[i]);
    counts_[i] += sign;
  }
}

bool OutcomeJudge::isSeen(const RunLog& log) const {
  const double begin_s = log.frames.back().time_s - kHold_s - kTimeSlack_s;
  std::array<int, kNeeded> seen{};
  std::size_t count = 0;
  for (auto frame = log.frames.rbegin(); frame != log.frames.rend(); ++frame) {
    if (frame->time_s < begin_s) break;
    for (const FeatureRecord& feature : frame->features) {
      if (!feature.measured) continue;
      const auto end = seen.begin() + count;
      if (std::find(seen.begin(), end, feature.id) == end) seen[count++] = feature.id;
      if (count >= needed_) return true;
    }
  }
  return needed_ == 0;
}

bool OutcomeJudge::hasProgress(const RunLog& log) const {
  const FrameRecord& last = log.frames.back();
  const double begin_s = last.time_s - kStall_s;
  const auto first = std::find_if(log.frames.rbegin(), log.frames.rend(), [&](const auto& frame) {
    return frame.time_s <= begin_s + kTimeSlack_s;
  });
  const Eigen::Vector3d way = last.robotPose - first->robotPose;
  if (way.head<2>().norm() > kStallWay_m || std::abs(way.z()) > kStallTurn_rad) return true;
  const double before = meanImageError(log, begin_s, begin_s + kMean_s);
  const double now = meanImageError(log, last.time_s - kMean_s, last.time_s);
  return now < (1 - kStallGain) * before;
}

}  // namespace depthservo
