#pragma once

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

  /// After the command: progress, from the frames so far. \param isTracking false while a feature
  /// is lost
  std::optional<Verdict> afterCommand(const RunLog& log, bool isTracking);

 private:
  bool hasProgress(const RunLog& log) const;  // over the last kStall_s

  PinholeCamera camera_;
  double tolerance_px_, Z_min_;
  double firstError_px_ = kUnknown;
  double trackingSince_s_ = kUnknown, lostSince_s_ = kUnknown;
};

}  // namespace depthservo
