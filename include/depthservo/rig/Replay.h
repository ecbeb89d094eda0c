#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "depthservo/observation/RunLog.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// Observes depth on recorded data: the same tracker and estimator as in the servo loop, with no
/// robot. \param progress called with the fraction done, may be empty \throw InputError the
/// sequence lacks what the options ask for, or an image cannot be read
RunLog replay(const Sequence& sequence, const ObservationOptions& options,
              const std::function<void(double)>& progress = {});

}  // namespace depthservo
