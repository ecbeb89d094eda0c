#pragma once

#include <cmath>

#include "depthservo/observation/RunLog.h"

namespace depthservo::test {

/// rms distance of the features from the true ones while hidden [px].
inline double predictionError_px(const RunLog& log) {
  double squares = 0;
  int n = 0;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& f : frame.features) {
      if (f.measured) continue;
      squares += std::pow(f.u - f.u_true, 2) + std::pow(f.v - f.v_true, 2);
      ++n;
    }
  }
  return std::sqrt(squares / n);
}

}  // namespace depthservo::test
