#pragma once

#include <string>
#include <vector>

#include "text/StrictYaml.h"

namespace depthservo {

/// Puts "key.path=value" into the tree; the value is YAML, null removes the key. \param keys that
/// there are \throw InputError
void applyOverride(detail::YamlValue& root, const std::string& file, const std::string& setting,
                   const std::vector<std::string>& keys);

}  // namespace depthservo
