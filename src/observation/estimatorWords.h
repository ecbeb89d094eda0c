#pragma once

#include <vector>

#include "depthservo/observation/EstimatorOptions.h"
#include "text/Names.h"

namespace depthservo {

const std::vector<detail::Choice<EstimatorKind>>& estimatorWords();
const std::vector<detail::Choice<ErrorKind>>& errorWords();

}  // namespace depthservo
