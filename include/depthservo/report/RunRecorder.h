#pragma once

#include <memory>
#include <string>
#include <vector>

#include "depthservo/observation/Exposure.h"
#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Files for others' tools; empty: not wanted.
struct RecordingFiles {
  std::string mcap;  ///< all that is seen and found, for Foxglove and its kin
  std::string tum;   ///< the camera's trajectory, for evo
};

/// What a run shows with an image.
struct RecordedFrame {
  const FrameRecord& record;
  const Exposure& exposure;
  const RunLog& log;                         ///< up to and including this frame, or its last part
  const std::vector<OdometryRow>& odometry;  ///< of the rig, at least since the image before
  RowMeaning rows;                           ///< what they mean
};

/// Writes what a run shows, image by image, as files that others' tools open; see doc/formats.md.
///
/// `mcap`: images, calibration, depths with their covariances, commands, events, and at the end the
/// diagnosis, as JSON messages of Foxglove's well-known schemas. `tum`: `timestamp tx ty tz qx qy
/// qz qw` of the camera as its odometry has it, from the first image on, which is the origin or,
/// where that is known, where the camera truly was.
///
/// Each appears whole or not at all. Equal runs give equal bytes.
class RunRecorder {
 public:
  /// \throw InputError a file exists or cannot be written
  explicit RunRecorder(const RecordingFiles& files);
  ~RunRecorder();

  /// \throw InputError an image is older than the epoch; \throw Interrupted
  void add(const RecordedFrame& frame);

  /// Makes the files appear. \param log of the whole run, or of its end \throw InputError,
  /// Interrupted
  void finish(const RunLog& log);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
