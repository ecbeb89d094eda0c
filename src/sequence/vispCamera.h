#pragma once

#include <string>

#include "depthservo/camera/PinholeCamera.h"

namespace depthservo::detail {

/// Whether a file is XML, hence a camera as ViSP writes it.
bool isXml(const std::string& path);

/// The one camera in an XML file as vpXmlParserCamera writes it: its model with distortion where it
/// has one. ViSP's `kud` is k1. Throws InputError: no camera, several, or parameters that none has.
PinholeCamera readVispCamera(const std::string& path);

}  // namespace depthservo::detail
