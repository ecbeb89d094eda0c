// Camera files: ROS camera_info, EuRoC's sensor.yaml, ViSP's XML.
#include <cmath>

#include "Target.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/text/InputError.h"
#include "sequence/cameraFiles.h"

namespace depthservo::fuzz {
namespace {

const Target kCamera("camera", [](const std::string& bytes) {
  const std::string file = written("camera", bytes);
  try {
    detail::readEurocPose(file);
  } catch (const InputError&) {  // it is another camera's
  }
  const PinholeCamera camera = loadCamera(file);
  require(camera.fx > 0 && std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy),
          "a finite camera");
});

}  // namespace
}  // namespace depthservo::fuzz
