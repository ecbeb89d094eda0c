#pragma once

#include <vector>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Events of one kind: equal but for the numbers of the points they name.
struct JoinedEvents {
  std::string what;  ///< as the first says it or, of many points, without their numbers
  std::size_t count = 0;
  double first_s = 0, last_s = 0;
};

/// By the time of the first. A kind that occurs rarely (up to `apart` times) is not joined.
std::vector<JoinedEvents> joined(const std::vector<Event>& events, std::size_t apart);

}  // namespace depthservo
