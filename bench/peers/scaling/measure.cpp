// SPDX-License-Identifier: BSD-3-Clause
// scaling_PROGRAM list: the points, a line each, series,size,n,p.
// scaling_PROGRAM time ROUNDS: ns of a step, a line a point in the order of the list, the median of so many
// rounds in which all points take turns. scaling_PROGRAM count STEPS: a breakpoint before and after STEPS
// steps of each point, for count_instructions.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "study.hpp"

namespace scaling {

std::vector<Point>& points() {
  static std::vector<Point> all;
  return all;
}

}  // namespace scaling

namespace {

/// s of processor time of this thread: what others run on the machine is not counted.
double now() {
  timespec at{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
  return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
}

double ns(const scaling::Point& point, long steps) {
  const double begin = now();
  point.run(steps);
  return 1e9 * (now() - begin) / static_cast<double>(steps);
}

void mark() { asm volatile("int3" : : : "memory"); }

}  // namespace

int main(int argc, char** argv) {
  auto& points = scaling::points();
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.series != b.series ? a.series < b.series : a.size < b.size;
  });
  const char* task = argc > 1 ? argv[1] : "";
  const long number = argc > 2 ? std::atol(argv[2]) : 0;
  if (std::strcmp(task, "list") == 0) {
    for (const auto& p : points) std::printf("%s,%g,%d,%d\n", p.series.c_str(), p.size, p.n, p.p);
    return 0;
  }
  if (number < 1) return 2;
  if (std::strcmp(task, "count") == 0) {
    for (const auto& p : points) {
      p.run(2 * number);
      mark();
      p.run(number);
      mark();
    }
    return 0;
  }
  std::vector<long> steps;
  std::vector<std::vector<double>> times(points.size());
  for (const auto& p : points) {
    p.run(16);
    steps.push_back(std::max(4L, static_cast<long>(5e5 / ns(p, 16))));  // half a millisecond
  }
  for (long round = 0; round < number; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) times[i].push_back(ns(points[i], steps[i]));
  }
  for (auto& of : times) {
    std::sort(of.begin(), of.end());
    std::printf("%.6g\n", of[of.size() / 2]);
  }
}
