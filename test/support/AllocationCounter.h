#pragma once

#include <cstddef>

namespace depthservo::test {

/// Heap allocations of the whole program so far: malloc, calloc and realloc, hence operator new and
/// ViSP's arrays too. Link AllocationCounter.cpp into the test program that asks; it replaces the
/// C library's allocation functions, which sanitizers do as well: label such a test `no-sanitizer`.
std::size_t allocations();

}  // namespace depthservo::test
