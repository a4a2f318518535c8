// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A trap for the heap: malloc and operator new of the whole program are counted while one is armed. For one
/// source file of a test program.
#pragma once

#include <cstdlib>

extern "C" void* __libc_malloc(std::size_t);

namespace heap_trap {
inline bool armed = false;
inline int allocations = 0;

struct Armed {
  Armed() {
    allocations = 0;
    armed = true;
  }
  ~Armed() { armed = false; }
};
}  // namespace heap_trap

extern "C" void* malloc(std::size_t size) {
  if (heap_trap::armed) ++heap_trap::allocations;
  return __libc_malloc(size);
}
void* operator new(std::size_t size) {
  if (heap_trap::armed) ++heap_trap::allocations;
  return __libc_malloc(size);
}
