// SPDX-License-Identifier: BSD-3-Clause
// On the target: runs every case with the heap trapped, compares with the host's numbers, counts
// instructions.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "reference.hpp"
#include "trajectory.hpp"

namespace {

bool heap_forbidden = false;
int heap_calls = 0;
void heap_used() { heap_calls += heap_forbidden ? 1 : 0; }

// SysTick of the Cortex-M, 24 bits, counting down.
volatile std::uint32_t& systick(std::uintptr_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(0xE000E010 + offset);
}
constexpr std::uint32_t systick_range = 0xFFFFFF;
constexpr double instructions_per_tick = 40;  // 25 MHz, and QEMU's -icount shift=0 makes an instruction 1 ns

// What a run used of the stack: what is below is painted before, and read after it.
constexpr std::size_t paintable = 120 * 1024, spared = 512;
__attribute__((noinline)) volatile std::uint32_t* below() {
  return reinterpret_cast<volatile std::uint32_t*>(
      (reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0)) - spared - paintable) &
      ~std::uintptr_t(3));
}
__attribute__((noinline)) void paint() {
  volatile std::uint32_t* const lowest = below();
  for (std::size_t i = 0; i < paintable / 4; ++i) lowest[i] = 0xA5A5A5A5;
}
__attribute__((noinline)) std::size_t stack_used() {
  const volatile std::uint32_t* const lowest = below();
  std::size_t i = 0;
  while (i < paintable / 4 && lowest[i] == 0xA5A5A5A5) ++i;
  return paintable + spared - 4 * i;
}

}  // namespace

extern "C" {  // by the linker's --wrap, every call in the image lands here
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* old, std::size_t size);
void* __wrap_malloc(std::size_t size) {
  heap_used();
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  heap_used();
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* old, std::size_t size) {
  heap_used();
  return __real_realloc(old, size);
}
}

int main() {
  systick(4) = systick_range;
  systick(8) = 0;
  systick(0) = 5;  // on, clocked with the processor
  bool passed = true;

  {  // the trap itself works
    heap_forbidden = true;
    int* volatile probe = new int(1);
    heap_forbidden = false;
    delete probe;
    if (heap_calls != 1) {
      std::printf("the heap is not trapped\n");
      passed = false;
    }
  }

  for (std::size_t c = 0; c < bare_metal::case_count; ++c) {
    bare_metal::Table table;
    heap_calls = 0;
    heap_forbidden = true;
    paint();
    const std::uint32_t start = systick(8);
    const bool usable = bare_metal::cases[c].run(measurements, table);
    const std::uint32_t ticks = (start - systick(8)) & systick_range;
    heap_forbidden = false;
    const std::size_t stack = stack_used();

    double largest = 0;
    for (int k = 0; k < bare_metal::numbers_kept; ++k) {
      double scale = 0, difference = 0;
      for (int i = 0; i < bare_metal::steps / bare_metal::kept_every; ++i) {
        scale = std::fmax(scale, std::fabs(reference[c][i][k]));
        const double apart = std::fabs(table[i][k] - reference[c][i][k]);
        if (!(apart <= difference)) difference = apart;  // a NaN stays
      }
      if (!(difference / scale <= largest)) largest = difference / scale;
    }
    const bool good = usable && heap_calls == 0 && largest <= bare_metal::cases[c].tolerance;
    passed = passed && good;
    std::printf(
        "%-25s %s: largest difference from the host %.1e (tolerance %.0e), %d heap calls, %.0f instructions "
        "a step, stack %u\n",
        bare_metal::cases[c].name, good ? "ok    " : "FAILED", largest, bare_metal::cases[c].tolerance,
        heap_calls, instructions_per_tick * ticks / bare_metal::steps, static_cast<unsigned>(stack));
  }
  return passed ? 0 : 1;
}
