// SPDX-License-Identifier: BSD-3-Clause
// The repository as the pages see it.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>

#include "pages.hpp"

namespace pages {

/// Paths of all files below root that pages may name; contents of those that are read.
inline Tree read_tree(const std::filesystem::path& root) {
  Tree tree;
  const auto take = [&](const std::filesystem::path& file) {
    const std::string extension = file.extension().string();
    std::string& content = tree[file.lexically_relative(root).generic_string()];
    if (extension != ".cpp" && extension != ".hpp" && extension != ".md" && extension != ".txt" &&
        extension != ".cmake" && extension != ".json" && extension != ".py")
      return;
    std::ifstream in(file, std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(in), {});
  };
  for (const char* folder : {"examples", "tests", "include", "cmake", "bench"}) {
    if (!std::filesystem::is_directory(root / folder)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.is_regular_file()) take(entry.path());
    }
  }
  for (const auto& entry : std::filesystem::directory_iterator(root)) {
    if (entry.is_regular_file()) take(entry.path());
  }
  return tree;
}

}  // namespace pages
