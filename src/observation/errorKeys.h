#pragma once

#include "depthservo/depth/ErrorProfile.h"
#include "text/Fields.h"

namespace depthservo {

/// The keys of a file of errors.
void describe(detail::Fields& f, ErrorProfile& errors);

}  // namespace depthservo
