#pragma once

#include <string>

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

}  // namespace depthservo
