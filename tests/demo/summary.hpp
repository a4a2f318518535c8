// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The summary.csv that a demo wrote, by name.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

namespace demo_results {

inline std::filesystem::path output(const std::string& demo) {
  return std::filesystem::path(DEMO_OUTPUT) / demo;
}

inline std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Summary {
 public:
  explicit Summary(const std::string& demo) {
    std::istringstream in(contents(output(demo) / "summary.csv"));
    std::string line;
    std::getline(in, line);
    EXPECT_EQ(line, "name,value,unit");
    while (std::getline(in, line)) {
      const auto comma = line.find(',');
      values_[line.substr(0, comma)] = std::stod(line.substr(comma + 1));
      EXPECT_GT(line.size(), line.rfind(',') + 1) << line << ": no unit";
      EXPECT_NE(line.rfind(','), comma) << line << ": no unit";
    }
  }
  double operator[](const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) ADD_FAILURE() << "no row " << name;
    return found == values_.end() ? NAN : found->second;
  }

 private:
  std::map<std::string, double> values_;
};

inline void expect_same_bytes_twice(const std::string& demo, const std::string& file = "summary.csv") {
  const std::string once = contents(output(demo) / file);
  EXPECT_GT(once.size(), 100U) << demo;
  EXPECT_EQ(once, contents(output(demo + "_again") / file)) << demo;
}

}  // namespace demo_results
