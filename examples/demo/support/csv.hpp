// SPDX-License-Identifier: BSD-3-Clause
// Reading a table of numbers.
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace demo {

/// The rows below the header line of a file of numbers; ends the program where the file is not that.
template <int columns>
std::vector<std::array<double, columns>> read_numbers(const std::filesystem::path& file, char separator) {
  const auto fail = [&file](const char* reason, std::size_t line) {
    std::fprintf(stderr, "%s, line %zu: %s\n", file.c_str(), line, reason);
    std::exit(1);
  };
  std::ifstream in(file);
  std::vector<std::array<double, columns>> rows;
  std::string line;
  if (!std::getline(in, line)) fail("cannot be read", 1);
  while (std::getline(in, line)) {
    const char* at = line.c_str();
    auto& row = rows.emplace_back();
    for (int i = 0; i < columns; ++i) {
      char* end = nullptr;
      row[static_cast<std::size_t>(i)] = std::strtod(at, &end);
      if (end == at || *end != (i + 1 < columns ? separator : '\0'))
        fail("not the expected numbers", rows.size() + 1);
      at = end + 1;
    }
  }
  return rows;
}
template <int columns>
std::vector<std::array<double, columns>> read_csv(const std::filesystem::path& file) {
  return read_numbers<columns>(file, ',');
}

}  // namespace demo
