#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/servo/RunLog.h"
#include "servo/World.h"

namespace depthservo {

/// Decides from what truly happens when a run is over, and how it ended.
class OutcomeJudge {
 public:
  /// \param tolerance_px rms image error at which the task counts as done
  /// \param Z_min distance of the camera to a dot that counts as a collision [m]
  OutcomeJudge(const PinholeCamera& camera, double tolerance_px, double Z_min);

  struct Verdict {
    Outcome outcome;
    std::string reason;
  };

  /// At exposure: whether the dots are where a camera can see them.
  std::optional<Verdict> atExposure(const std::vector<World::TruePoint>& truth) const;

  /// After the command: progress. \param isTracking false while a feature is lost
  std::optional<Verdict> afterCommand(const FrameRecord& frame, bool isTracking);

 private:
  /// A frame as far as progress goes.
  struct Step {
    double time_s;
    double error_px;
    Eigen::Vector3d robotPose;
  };

  bool hasSeen(double period_s) const;                 // the whole of the last period
  double meanError(double from_s, double to_s) const;  // [px]
  bool hasProgress() const;                            // from the first to the last of recent_

  PinholeCamera camera_;
  double tolerance_px_, Z_min_;
  std::deque<Step> recent_;
  double firstError_px_ = kUnknown;
  double lostSince_s_ = kUnknown;
};

}  // namespace depthservo
