#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "text/Fields.h"

namespace depthservo {

/// The keys of a file of errors.
DEPTHSERVO_INNER void describe(detail::Fields& f, ErrorProfile& errors);

}  // namespace depthservo
