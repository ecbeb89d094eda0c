#pragma once

#include "depthservo/api.h"
#include "sequence/bag/MessageReader.h"
#include "sequence/imageFormats.h"

namespace depthservo::detail {

/// sensor_msgs/Image as an image format: gray and colours of 8 and 16 bits, raw Bayer patterns of
/// 8 bits, YUV 4:2:2.
DEPTHSERVO_INNER ImageFormat rosImageFormat(MessageEncoding encoding);

/// Whether images of this encoding are depths ([mm] of 16 bits or [m]), not gray levels.
bool isDepthEncoding(const std::string& encoding);

}  // namespace depthservo::detail
