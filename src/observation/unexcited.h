#pragma once

#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Some time in which the camera's motion told nothing of a point's depth.
struct UnexcitedPeriod {
  int point = 0;
  double begin_s = 0, end_s = 0;
  std::string because;  ///< "no translation": as after `kUnexcitedFor_s`, or at the end
};

/// A depth that was `unexcited` this long is worth a word.
constexpr double kUnexcitedFor_s = 1;

/// All such periods of a log that are long enough, by time.
std::vector<UnexcitedPeriod> unexcitedPeriods(const RunLog& log);

/// Adds an event where each begins, one for all points it concerns; events stay ordered by time.
void addUnexcitedEvents(RunLog& log);

}  // namespace depthservo
