#pragma once

#include <functional>
#include <string>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/rig/Replay.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/sequence/TwistStream.h"
#include "depthservo/sequence/VideoSource.h"

namespace depthservo {

struct LiveOptions {
  std::string name = "live";
  PinholeCamera camera;
  SequenceTarget target;      ///< dots, AprilTags; none: natural corners
  std::string targetFile;     ///< that named it, for messages; may be empty
  ObservationOptions observation;  ///< tracker, estimator, first guess, noise; motion plays no part
  double rate = 0;            ///< images per second, 0: not known; for the gain of `pose` [Hz]
  double duration_s = 0;      ///< stop after this time of the images' clock; 0: at their end
  bool keepsLog = true;       ///< false: only the last frames stay in memory

  /// How long an image waits for the twists of its time [s]: as long as they are late the first
  /// time, then no more until they come again.
  double patience_s = 0.2;
};

/// What happens in one image.
struct LiveFrame {
  const FrameRecord& record;
  const DEPTHSERVO_VISP vpImage<unsigned char>& image;
  const RunLog& log;                  ///< up to and including this frame, or its last part
  const TwistStream::Counts* twists;  ///< none when the target tells the motion
};

/// Observes depth while images come: the tracker and the estimators of `replay`, with the camera's
/// motion from a stream of twists or from a known target. Nothing waits for ever: late odometry
/// makes points coast, what is refused is counted and told in the log's events, and the end of the
/// images is the regular end.
///
/// The same images, times and twists give the same estimates as a replay.
class Live {
 public:
  /// \param twists null: the motion is that of the target, which needs four points
  /// \throw InputError there is nothing to track, no motion, or not what the estimator needs
  Live(const LiveOptions& options, ImageSource& images, TwistStream* twists);

  /// Until the images end, the duration is over or `watch` says false. Call once.
  /// \param watch may be empty \throw InputError an image of another size than the camera's
  RunLog run(const std::function<bool(const LiveFrame&)>& watch = {});

 private:
  LiveOptions options_;
  ImageSource& images_;
  TwistStream* twists_;
};

}  // namespace depthservo
