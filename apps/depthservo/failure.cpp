#include "failure.h"

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>

#include "depthservo/text/InputError.h"
#include "exitCodes.h"

namespace depthservo {
namespace {

int tellInternal(const char* what) {
  fmt::print(stderr, "depthservo: internal error: {}\n", what);
  return kInternalError;
}

}  // namespace

int tellFailure(std::exception_ptr failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return kBadInput;
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string where = error.path1().string();
    fmt::print(stderr, "{}\n", InputError({where, 0, ""}, error.code().message()).what());
    return kBadInput;
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) == 0) return tellInternal(error.what());
    fmt::print(stderr, "standard output: cannot be written: {}\n", error.code().message());
    return kBadInput;
  } catch (const std::bad_alloc&) {
    return tellInternal("out of memory");
  } catch (const std::exception& error) {
    return tellInternal(error.what());
  } catch (...) {
    return tellInternal("unknown");
  }
}

}  // namespace depthservo
