#include "failure.h"

#include <fmt/core.h>

#include <filesystem>
#include <new>

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
    fmt::print(stderr, "depthservo: {}\n", error.what());
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
