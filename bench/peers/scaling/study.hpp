// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A list of things to measure against a size; filled by the files that are linked together, each with few
/// sizes.
#pragma once

#include <string>
#include <vector>

namespace scaling {

/// One point of a series: `run` takes so many steps from where the last call ended.
struct Point {
  std::string series;
  double size;
  int n, p;
  void (*run)(long steps);
};
std::vector<Point>& points();

struct Register {
  Register(const char* series, double size, int n, int p, void (*run)(long)) {
    points().push_back({series, size, n, p, run});
  }
};

/// The value is taken as read and written here: what led to it is not optimised away.
template <typename T>
inline void keep(T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

}  // namespace scaling
