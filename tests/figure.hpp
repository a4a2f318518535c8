// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A figure of a test that README or guide quote: one line of its output, which the targets of tests/guide
/// read.
#pragma once

#include <cstdio>
#include <string>

namespace figure {

/// "figure: NAME = VALUE (UNIT)"; "-" for numbers and what has no unit.
inline void print(const std::string& name, double value, const char* unit = "-") {
  std::printf("figure: %s = %.9g (%s)\n", name.c_str(), value, unit);
}

}  // namespace figure
