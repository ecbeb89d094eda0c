#include "text/module.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "depthservo/text/InputError.h"

namespace depthservo::detail {

namespace fs = std::filesystem;

std::vector<fs::path> modulePlaces(const std::string& file) {
  Dl_info here{};
  if (!dladdr(reinterpret_cast<const void*>(&modulePlaces), &here) || !here.dli_fname) return {};
  std::error_code error;
  const fs::path folder = fs::canonical(here.dli_fname, error).parent_path();
  // Of a static library `here` is the program.
  return {folder / file, folder / "depthservo" / file,
          folder / DEPTHSERVO_BIN_TO_LIB / "depthservo" / file};
}

void* loadModule(const std::vector<fs::path>& places, const char* name, const std::string& lack) {
  for (const fs::path& place : places) {
    std::error_code error;
    if (!fs::exists(place, error)) continue;
    void* const module = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const function = module ? dlsym(module, name) : nullptr;
    if (function) return function;
    const char* const reason = dlerror();
    throw InputError({place.string(), 0, ""},
                     fmt::format("cannot be loaded, without which there are no {}: {}", lack,
                                 reason ? reason : "unknown"));
  }
  throw InputError({places.empty() ? "module" : places.back().string(), 0, ""},
                   fmt::format("is missing, without which there are no {}", lack));
}

}  // namespace depthservo::detail
