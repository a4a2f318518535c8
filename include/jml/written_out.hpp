// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Loops that are written out where they are short, so that the optimiser sees single numbers in registers
/// where it would else see an array.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/attributes.hpp>
#include <utility>

#if JML_GNU && !defined(__clang__)
#define JML_WRITTEN_OUT _Pragma("GCC unroll 9")
#define JML_TWICE _Pragma("GCC unroll 2")
#else
/// Before a loop of at most nine turns: unrolled, where the compiler has a word for that.
#define JML_WRITTEN_OUT
/// Before a longer loop: two turns at a time.
#define JML_TWICE
#endif
/// for (i = 0; i < count; ++i) body, for the entries of a matrix in matrix.hpp and matrix_operators.hpp: a
/// lambda would cost the compiler a type for each use and size.
#define JML_EACH(i, count, body)                            \
  if constexpr ((count) <= 9) {                             \
    JML_WRITTEN_OUT for (int i = 0; i < (count); ++i) body; \
  } else {                                                  \
    for (int i = 0; i < (count); ++i) body;                 \
  }

namespace jml::kernel {

/// f(0), f(1), …, f(count - 1): written out up to `limit`, a loop for more.
template <int count, int limit = 3, typename F>
JML_INLINE inline void repeat(const F& f) {
  if constexpr (count <= limit) {
    [&]<int... i>(std::integer_sequence<int, i...>)
        JML_INLINE { (f(i), ...); }(std::make_integer_sequence<int, count>{});
  } else {
    if constexpr (count <= 8) {
      JML_WRITTEN_OUT for (int i = 0; i < count; ++i) f(i);
    } else {
      JML_TWICE for (int i = 0; i < count; ++i) f(i);
    }
  }
}

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
