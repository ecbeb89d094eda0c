#pragma once

#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo {

/// "; did you mean 'x'?" with the word among `valid` that is nearest; empty when none is near.
DEPTHSERVO_API std::string didYouMean(const std::string& word,
                                      const std::vector<std::string>& valid);

/// The same of a file or folder that is not there, with the nearest beside it.
DEPTHSERVO_API std::string didYouMeanFile(const std::string& path);

}  // namespace depthservo
