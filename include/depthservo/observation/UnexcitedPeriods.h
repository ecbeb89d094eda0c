#pragma once

#include <map>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/Excitation.h"
#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Some time in which the camera's motion told nothing of a point's depth.
struct UnexcitedPeriod {
  int point = 0;
  double begin_s = 0, end_s = 0;
  std::string because;  ///< "no translation": as after `kUnexcitedFor_s`, or at the end

  double duration_s() const { return end_s - begin_s; }
};

/// A depth that was `unexcited` this long is worth a word.
constexpr double kUnexcitedFor_s = 1;

/// Finds such periods image by image. Points that are no longer in the images are forgotten.
class DEPTHSERVO_API UnexcitedPeriods {
 public:
  void add(const FrameRecord& frame);

  /// The periods that have ended since the last call and were long enough.
  std::vector<UnexcitedPeriod> takeEnded();
  /// The one that a point is in, or null.
  const UnexcitedPeriod* current(int point) const;
  /// Those that all points are in, long enough.
  std::vector<UnexcitedPeriod> current() const;

 private:
  struct Point {
    UnexcitedPeriod period;
    bool isIn = false;
    std::size_t frame = 0;  // that knew it last
  };
  void end(Point& point);

  Excitation excitation_;
  std::map<int, Point> points_;
  std::vector<UnexcitedPeriod> ended_;
  double last_s_ = kUnknown;
  std::size_t frames_ = 0;
};

/// All such periods of a log that are long enough, by time.
DEPTHSERVO_API std::vector<UnexcitedPeriod> unexcitedPeriods(const RunLog& log);

/// Adds an event where each begins, one for all points it concerns; events stay ordered by time.
DEPTHSERVO_API void addUnexcitedEvents(RunLog& log);

}  // namespace depthservo
