// A fuzzer (libFuzzer) of the reader that the environment's FUZZ_TARGET names: scripts/fuzz.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "Target.h"

using depthservo::fuzz::targets;

namespace {

depthservo::fuzz::Read chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("FUZZ_TARGET");
  const auto found = targets().find(name ? name : "");
  if (found == targets().end()) {
    for (const auto& target : targets()) std::printf("%s\n", target.first.c_str());
    std::exit(name ? 2 : 0);
  }
  chosen = found->second;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  depthservo::fuzz::feed(chosen, {reinterpret_cast<const char*>(bytes), size});
  return 0;
}
