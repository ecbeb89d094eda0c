#pragma once

#include <string>

#include "depthservo/text/Refuse.h"

namespace depthservo::detail {

/// For the keys of a section.
inline Refuse below(const std::string& section, const Refuse& refuse) {
  return [=](const std::string& key, const std::string& message) {
    refuse(section + "." + key, message);
  };
}

}  // namespace depthservo::detail
