#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/observation/Exposure.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/servo/ServoOptions.h"
#include "servo/SpeedGovernor.h"

namespace depthservo {

/// Decides from what truly happens when a run is over, and how it ended.
class OutcomeJudge {
 public:
  /// \param noun what a point is called: dot | corner
  OutcomeJudge(const PinholeCamera& camera, const ControlOptions& control, double Z_min,
               std::size_t points, const char* noun);

  struct Verdict {
    Outcome outcome;
    std::string reason;
  };

  /// At exposure: whether enough dots are where a camera can see them.
  std::optional<Verdict> atExposure(double time_s, const std::vector<TruePoint>& truth);

  /// It looks back at the frames of this time [s].
  static const double kLooksBack_s;

  /// After the command: progress, from the frames so far.
  std::optional<Verdict> afterCommand(const RunLog& log, Basis basis);

  /// Forgets how long things have lasted.
  void restart();

 private:
  /// Something that lasts: since when, or unknown while it does not.
  class Since {
   public:
    void update(bool isSo, double time_s) {
      if (!isSo) begin_s_ = kUnknown;
      if (isSo && std::isnan(begin_s_)) begin_s_ = time_s;
    }
    bool lasts(double duration_s, double time_s) const;

   private:
    double begin_s_ = kUnknown;
  };
  /// The image error over the last kHold_s as a sum that goes along, so that only those near the
  /// tolerance need be computed from all frames.
  class RunningError {
   public:
    /// \return it [px], to rounding; unknown: there is none
    double follow(const RunLog& log);

   private:
    void add(const FrameRecord& frame, const RunLog& log, int sign);

    std::vector<Eigen::Vector2d> sums_;  // by feature
    std::vector<int> counts_;
    std::size_t frames_ = 0;  // the last ones of the log
    double last_s_ = kUnknown;
  };

  bool hasProgress(const RunLog& log) const;  // over the last kStall_s
  bool isSeen(const RunLog& log) const;       // enough points, over the last kHold_s
  Verdict leftImage(const char* what) const;

  PinholeCamera camera_;
  double tolerance_px_, Z_min_, wait_s_;
  bool allInImage_;
  std::size_t needed_;  // points
  const char* noun_;
  double firstError_px_ = kUnknown;
  std::optional<std::size_t> outside_;  // a dot that is not in the image now,
  TruePoint outsideAt_{};               // where it left it
  RunningError running_;
  Since tracking_, unhindered_, lost_, waiting_, away_;
};

}  // namespace depthservo
