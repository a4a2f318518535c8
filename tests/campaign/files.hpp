// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A directory of a test's own, and whole files as strings.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace files {

class Directory {
 public:
  Directory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "jml-campaign-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Directory() { std::filesystem::remove_all(path_); }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
inline void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// CSV and JSON of a result, one after the other.
template <typename Result>
std::string report(const Result& result, const Directory& directory) {
  const bool written =
      result.write_csv(directory / "report.csv") && result.write_json(directory / "report.json");
  return written ? content(directory / "report.csv") + content(directory / "report.json") : "not written";
}

}  // namespace files
