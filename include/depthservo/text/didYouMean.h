#pragma once

#include <string>
#include <vector>

namespace depthservo {

/// "; did you mean 'x'?" with the word among `valid` that is nearest; empty when none is near.
std::string didYouMean(const std::string& word, const std::vector<std::string>& valid);

/// The same of a file or folder that is not there, with the nearest beside it.
std::string didYouMeanFile(const std::string& path);

}  // namespace depthservo
