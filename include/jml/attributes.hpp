// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is said to GCC and Clang beyond the standard, each thing behind one spelling. Another compiler reads
/// standard C++.
#include <jml/warnings_begin.hpp>
#pragma once

#if !defined(JML_GNU)
#if defined(__GNUC__)
#define JML_GNU 1
#else
/// 1: GCC or Clang. 0: another compiler: no attributes, and plain scalars for packets. May be set from
/// outside: with 0, GCC compiles what others do.
#define JML_GNU 0
#endif
#endif

/// A step is one chain of small functions: each is inlined, so that sizes and zeros are known where they are
/// used. JML_PLAIN_INLINING leaves that to the compiler: smaller code that is faster to compile and slower to
/// run.
#if JML_GNU && !defined(JML_PLAIN_INLINING)
#define JML_INLINE __attribute__((always_inline))
#else
#define JML_INLINE
#endif

#if JML_GNU
#define JML_NOINLINE __attribute__((noinline))
#define JML_RARE __attribute__((noinline, cold))
#define JML_UNREACHABLE __builtin_unreachable()
#else
/// A rare way, kept out of the way of the usual one.
#define JML_NOINLINE
/// The same, of which moreover size and compile time count, not speed: what a healthy flight never asks for.
#define JML_RARE
/// The end of a function that nobody calls.
#define JML_UNREACHABLE \
  for (;;) {            \
  }
#endif
#include <jml/warnings_end.hpp>
