// SPDX-License-Identifier: BSD-3-Clause
// scaling_PROGRAM list: the points, a line each, series,size,n,p.
// scaling_PROGRAM time ROUNDS: ns of a step, a line a point in the order of the list, one number a round; all
// points take turns in each round, those of one size next to each other. scaling_PROGRAM count STEPS: a
// breakpoint before and after STEPS steps of each point, for count_instructions.
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
    return a.n != b.n ? a.n < b.n : a.size != b.size ? a.size < b.size : a.series < b.series;
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
    steps.push_back(std::max(4L, static_cast<long>(2e6 / ns(p, 16))));  // two milliseconds
  }
  for (long round = 0; round < number; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) times[i].push_back(ns(points[i], steps[i]));
  }
  for (const auto& of : times) {
    for (std::size_t i = 0; i < of.size(); ++i) std::printf("%s%.6g", i == 0 ? "" : ",", of[i]);
    std::printf("\n");
  }
}
