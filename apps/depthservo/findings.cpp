#include "findings.h"

#include <fmt/core.h>

namespace depthservo {

void printFindings(const RunLog& log) {
  if (log.diagnosis && log.diagnosis->isFault()) {
    fmt::print(stderr, "diagnosis: {}\n", log.diagnosis->message());
  }
  if (log.noise) fmt::print(stderr, "noise, learnt: {}\n", sentenceOf(*log.noise));
  if (!log.joint) return;
  for (const std::string& sentence : log.joint->sentences(log.camera.focal_px())) {
    fmt::print(stderr, "joint filter: {}\n", sentence);
  }
}

}  // namespace depthservo
