#pragma once

#include <stdexcept>
#include <string>

namespace depthservo::detail {

/// What an object needs to be made. \throws std::invalid_argument "who: what" when it is not met
inline void require(const char* who, bool isMet, const std::string& what) {
  if (!isMet) throw std::invalid_argument(std::string(who) + ": " + what);
}

}  // namespace depthservo::detail
