#pragma once

#include <string>
#include <vector>

#include "depthservo/depth/DepthEstimate.h"

namespace depthservo {

/// The word of every depth status, by its number.
inline const std::vector<std::string>& statusNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (int i = 0; i <= static_cast<int>(DepthStatus::lost); ++i) {
      all.emplace_back(toString(static_cast<DepthStatus>(i)));
    }
    return all;
  }();
  return names;
}

}  // namespace depthservo
