#pragma once

#include <string>
#include <vector>

#include "text/KeyTree.h"

namespace depthservo::detail {

/// As of keyPages.h, of any keys.
std::string keysAsText(const std::vector<KeyNode>& keys, const std::string& prefix);
std::string keysAsMarkdown(const std::vector<KeyNode>& keys);
std::string schemaText(const std::vector<KeyNode>& keys, const char* title);

}  // namespace depthservo::detail
