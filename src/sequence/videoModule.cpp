#include "sequence/videoModule.h"

#include "text/module.h"

namespace depthservo::detail {

std::vector<std::filesystem::path> videoModulePlaces() {
  return modulePlaces("libdepthservo_video.so");
}

OpenVideo* loadVideoModule(const std::vector<std::filesystem::path>& places) {
  return reinterpret_cast<OpenVideo*>(
      loadModule(places, kOpenVideo, "videos and cameras (images may come as FOLDER/%06d.png)"));
}

}  // namespace depthservo::detail
