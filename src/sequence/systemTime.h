#pragma once

#include <chrono>

namespace depthservo::detail {

/// The system's clock, that of a camera's images: since 1970 [s].
inline double systemTime_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace depthservo::detail
