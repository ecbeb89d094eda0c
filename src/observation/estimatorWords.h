#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/EstimatorOptions.h"
#include "text/Names.h"

namespace depthservo {

DEPTHSERVO_INNER const std::vector<detail::Choice<EstimatorKind>>& estimatorWords();
DEPTHSERVO_INNER const std::vector<detail::Choice<ErrorKind>>& errorWords();

}  // namespace depthservo
