// SPDX-License-Identifier: BSD-3-Clause
// On the host: writes the measurements and the host's results as a header for the target.
#include <cstdint>
#include <cstdio>

#include "trajectory.hpp"

int main() {
  double y[bare_metal::steps];
  std::uint32_t random = 1;
  jml::Vector<double, 2> x{1, 0};
  for (double& measured : y) {
    x = models::VanDerPol{}.dynamics(x);
    random = 1664525u * random + 1013904223u;  // Numerical Recipes' generator: the noise is uniform in ±0.1
    measured = models::SaturatingPosition{}.measurement(x)(0) + 0.2 * (random * 0x1p-32 - 0.5);
  }
  std::printf(
      "// Generated: hexadecimal, so that nothing is rounded on the way.\n#pragma once\n#include "
      "\"trajectory.hpp\"\n\n");
  std::printf("inline constexpr double measurements[bare_metal::steps] = {\n");
  for (const double measured : y) std::printf("%a,\n", measured);
  std::printf("};\ninline constexpr bare_metal::Table reference[bare_metal::case_count] = {\n");
  for (const auto& one : bare_metal::cases) {
    bare_metal::Table table;
    if (!one.run(y, table)) {
      std::fprintf(stderr, "%s: a step was refused on the host\n", one.name);
      return 1;
    }
    std::printf("{\n");
    for (const auto& row : table) {
      std::printf("{");
      for (const double number : row) std::printf("%a,", number);
      std::printf("},\n");
    }
    std::printf("},\n");
  }
  std::printf("};\n");
}
