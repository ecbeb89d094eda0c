#include "support/AllocationCounter.h"

#include <atomic>

namespace {
std::atomic<std::size_t> count{0};
}

// glibc's own allocator, under the names it keeps for those who replace the public ones. The
// address sanitizer has replaced them itself; nothing is counted then, and tests that count are
// labelled no-sanitizer.
#ifndef __SANITIZE_ADDRESS__
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);

void* malloc(std::size_t size) {
  ++count;
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  ++count;
  return __libc_calloc(n, size);
}
void* realloc(void* memory, std::size_t size) {
  ++count;
  return __libc_realloc(memory, size);
}
}
#endif

namespace depthservo::test {

std::size_t allocations() { return count; }

}  // namespace depthservo::test
