#pragma once

#include <string>
#include <string_view>

#include "depthservo/api.h"

namespace depthservo::detail {

/// RFC 4648, with padding.
DEPTHSERVO_INNER std::string base64(std::string_view bytes);

}  // namespace depthservo::detail
