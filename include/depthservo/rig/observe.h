#pragma once

#include "depthservo/api.h"
#include "depthservo/observation/Observer.h"
#include "depthservo/rig/Rig.h"

namespace depthservo {

/// What a run shows, image by image, to whoever watches it: a window, a recorder, a progress bar.
struct RunFrame {
  const FrameRecord& record;
  const Exposure& exposure;
  const RunLog& log;  ///< up to and including this frame, or its last part
  const Rig& rig;
};

class DEPTHSERVO_API RunWatcher {
 public:
  virtual ~RunWatcher() = default;
  /// False: stop here.
  virtual bool onFrame(const RunFrame& frame) = 0;
};

/// What of a run stays in memory.
enum class Keep {
  everything,
  theLastFrames,  ///< and no images: for runs without end
  theOutcome,     ///< the same, and nothing is diagnosed: for many runs
};

/// Adds one image to the log.
DEPTHSERVO_API void append(RunLog& log, FrameRecord frame, const Exposure& exposure, Keep keep);

/// Lets go of all events and of what lies back by more than some 300 frames, now and then, so that
/// a run without end does not grow. Frames are fewer then than before.
DEPTHSERVO_API void forgetTheOld(RunLog& log);

/// Adds what the rig and the observer have to say.
DEPTHSERVO_API void takeEvents(RunLog& log, Rig& rig, Observer& observer);

/// Observes all images of a rig, with no robot that is commanded. \param watcher may be null
DEPTHSERVO_API RunLog observe(Rig& rig, Observer& observer, RunWatcher* watcher = nullptr,
                              Keep keep = Keep::everything);

}  // namespace depthservo
