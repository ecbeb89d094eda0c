#pragma once

#include <string>

#include "depthservo/rig/observe.h"

namespace depthservo {

/// One line on stderr that is drawn over itself; nothing at all when stderr is not a terminal.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();

  /// \param fraction 0..1 \param words behind it
  void show(double fraction, const std::string& words = "");

 private:
  std::string label_;
  bool isTerminal_;
  int shown_percent_ = -1;
  std::size_t words_ = 0;  // width of the widest
};

/// How far a run is, by the time of its images.
class RunProgress : public RunWatcher {
 public:
  RunProgress(std::string label, double from_s, double to_s)
      : from_s_(from_s), to_s_(to_s), bar_(std::move(label)) {}
  bool onFrame(const RunFrame& frame) override {
    bar_.show((frame.record.time_s - from_s_) / (to_s_ - from_s_));
    return true;
  }

 private:
  double from_s_, to_s_;
  ProgressBar bar_;
};

}  // namespace depthservo
