#pragma once

#include <optional>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"

namespace depthservo {

/// The errors in force. \param options with motion chosen
DEPTHSERVO_INNER ErrorKind errorKindOf(const ObservationOptions& options);

/// Their profile; none: `declared` and `exact`. What is declared besides replaces its part of it.
DEPTHSERVO_INNER std::optional<ErrorProfile> errorsOf(const ObservationOptions& options);

}  // namespace depthservo
