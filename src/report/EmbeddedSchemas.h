#pragma once

#include <string_view>

namespace depthservo {

/// JSON schemas of the messages in MCAP files; see data/foxglove.
struct EmbeddedSchemas {
  std::string_view image, calibration, transform, cloud, scene, annotations, log, depths, robot;
};
const EmbeddedSchemas& embeddedSchemas();

}  // namespace depthservo
