#pragma once

#include <functional>
#include <string>

namespace depthservo {

/// Hears what is wrong with options: the key, below theirs ("limits.pan_min"), and why. It may
/// throw.
using Refuse = std::function<void(const std::string& key, const std::string& message)>;

}  // namespace depthservo
