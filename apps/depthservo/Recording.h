#pragma once

#include "depthservo/report/RunRecorder.h"
#include "depthservo/rig/observe.h"

namespace depthservo {

/// Hands what a run shows to a RunRecorder.
class Recording : public RunWatcher {
 public:
  /// \param next watches, too; may be null \throw InputError
  explicit Recording(const RecordingFiles& files, RunWatcher* next = nullptr)
      : recorder_(files), next_(next) {}

  bool onFrame(const RunFrame& frame) override {
    recorder_.add(
        {frame.record, frame.exposure, frame.log, frame.rig.odometry(), frame.rig.source().rows});
    return !next_ || next_->onFrame(frame);
  }
  void finish(const RunLog& log) { recorder_.finish(log); }

 private:
  RunRecorder recorder_;
  RunWatcher* next_;
};

}  // namespace depthservo
