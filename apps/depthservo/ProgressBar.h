#pragma once

#include <string>

#include "depthservo/servo/ServoLoop.h"

namespace depthservo {

/// One line on stderr that is drawn over itself; nothing at all when stderr is not a terminal.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();

  /// \param fraction 0..1
  void show(double fraction);

 private:
  std::string label_;
  bool isTerminal_;
  int shown_percent_ = -1;
};

/// How far a run of a scenario is.
class RunProgress : public RunWatcher {
 public:
  RunProgress(std::string label, const Scenario& scenario)
      : duration_s_(scenario.duration), bar_(std::move(label)) {}
  void onFrame(const RunFrame& frame) override { bar_.show(frame.record.time_s / duration_s_); }

 private:
  double duration_s_;
  ProgressBar bar_;
};

}  // namespace depthservo
