#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/depth/FocalLengthObserver.h"
#include "depthservo/rig/RecordedRig.h"

namespace depthservo {

struct FocalReplayOptions {
  ObservationOptions replay;        ///< tracker, motion and pixel noise
  std::optional<FocalGains> gains;  ///< none: for the motion and the points of the sequence

  /// Depth of the points [m]; with it the lever arm of the camera is compensated.
  std::optional<double> Z;
};

/// One point in one frame.
struct FocalRecord {
  double time_s = 0;
  int id = 0;
  bool measured = false;
  FocalEstimate estimate;
};

/// What a point says of the focal length in the end.
struct FocalPoint {
  int id = 0;
  FocalEstimate estimate;
  std::size_t measured_frames = 0;
  std::string unexcited_because;  ///< empty: it is excited
};

/// Focal length on recorded data.
struct FocalReplay {
  std::string name;
  PinholeCamera camera;
  FocalGains gains;
  std::size_t frames = 0;
  double duration_s = 0;
  std::vector<FocalRecord> records;  ///< by time and id
  std::vector<FocalPoint> points;    ///< by id

  double focal_px = kUnknown;        ///< weighted mean of the valid points, of all without any
  double sigma_focal_px = kUnknown;  ///< under the image noise
  DepthStatus status = DepthStatus::unset;  ///< valid with a valid point, else the best

  /// How far the camera is ahead of the axis it turns about, as its motion tells [m].
  double lever_m = kUnknown;
  std::optional<double> Z;
  double compensated_px = kUnknown;  ///< focal_px / (1 + lever_m/Z); unknown without Z
};

/// Observes the focal length in a sequence of a camera that turns, from each point on its own with
/// FocalLengthObserver. The principal point and the ratio of the focal lengths are taken from the
/// sequence's camera, its focal length is not used, except by a tracker.
/// \throw InputError what `replay` refuses; the motion is that of the target (which needs the focal
/// length); the camera never turns across its optical axis, with the reason in words
FocalReplay replayFocal(const Sequence& sequence, const FocalReplayOptions& options,
                        RunWatcher* watcher = nullptr);

/// The first point whose lambda and 1/lambda, estimated apart, contradict each other though both have
/// settled; nothing when there is none.
const FocalPoint* contradicted(const FocalReplay& replay);

/// In words: the lever arm and what to do about it, and whether the estimate contradicts itself.
std::string remark(const FocalReplay& replay);

/// One JSON object.
std::string toJson(const FocalReplay& replay);

/// Writes `run.json`, `focal.csv` (timestamp, id, measured, focal, sigma_focal, inverse_focal,
/// eta1, eta2, sigma_min, status), `focal.png` and `report.html`. \return whether the plot was
/// drawn \throw InputError the place is refused or cannot be written to
bool writeFocalFolder(const FocalReplay& replay, const std::filesystem::path& folder);

}  // namespace depthservo
