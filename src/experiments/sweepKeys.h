#pragma once

#include "depthservo/experiments/Sweep.h"
#include "text/Fields.h"

namespace depthservo {

/// Every key of a sweep file.
void describe(detail::Fields& f, SweepOptions& sweep);

const std::vector<detail::Choice<SweepFigure>>& figureWords();

}  // namespace depthservo
