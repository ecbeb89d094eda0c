#include "sequence/videoModule.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "depthservo/text/InputError.h"

namespace depthservo::detail {

namespace fs = std::filesystem;

std::vector<fs::path> videoModulePlaces() {
  const fs::path name = "libdepthservo_video.so";
  Dl_info here{};
  if (!dladdr(reinterpret_cast<const void*>(&videoModulePlaces), &here) || !here.dli_fname)
    return {};
  std::error_code error;
  const fs::path folder = fs::canonical(here.dli_fname, error).parent_path();
  // Of a static library `here` is the program.
  return {folder / name, folder / "depthservo" / name,
          folder / DEPTHSERVO_BIN_TO_LIB / "depthservo" / name};
}

OpenVideo* loadVideoModule(const std::vector<fs::path>& places) {
  for (const fs::path& place : places) {
    std::error_code error;
    if (!fs::exists(place, error)) continue;
    void* const module = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const function = module ? dlsym(module, kOpenVideo) : nullptr;
    if (function) return reinterpret_cast<OpenVideo*>(function);
    const char* const reason = dlerror();
    throw InputError({place.string(), 0, ""},
                     fmt::format("cannot be loaded, without which there are no videos and cameras: "
                                 "{}",
                                 reason ? reason : "unknown"));
  }
  throw InputError({places.empty() ? "libdepthservo_video.so" : places.back().string(), 0, ""},
                   "is missing, without which there are no videos and cameras; install it, or give "
                   "images as FOLDER/%06d.png");
}

}  // namespace depthservo::detail
