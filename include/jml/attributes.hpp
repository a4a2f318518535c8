// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Attributes of functions and lambdas, each behind one spelling.
#include <jml/warnings_begin.hpp>
#pragma once

/// A step is one chain of small functions: each is inlined, so that sizes and zeros are known where they are
/// used. JML_PLAIN_INLINING leaves that to the compiler: smaller code that is faster to compile and slower to
/// run.
#if defined(JML_PLAIN_INLINING)
#define JML_INLINE
#else
#define JML_INLINE __attribute__((always_inline))
#endif

/// A rare way, kept out of the way of the usual one.
#define JML_NOINLINE __attribute__((noinline))
/// The same, of which moreover size and compile time count, not speed: what a healthy flight never asks for.
#define JML_RARE __attribute__((noinline, cold))
#include <jml/warnings_end.hpp>
