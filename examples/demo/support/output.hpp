// SPDX-License-Identifier: BSD-3-Clause
// What a demo leaves behind: files in one directory, and an aligned table for the reader.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace demo {

/// A number as text; printf's format. "-" where there is none.
inline std::string text(const char* format, double value) {
  if (value != value) return "-";
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// The same with a star where `missing` values are left out of it.
inline std::string starred(const char* format, double value, int missing) {
  return text(format, value) + (missing > 0 ? "*" : "");
}

/// The directory given as first argument, created; ends the program where that is impossible.
inline std::filesystem::path output_directory(int argc, char** argv, const char* usage) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s %s\n", argv[0], usage);
    std::exit(2);
  }
  std::error_code error;
  std::filesystem::create_directories(argv[1], error);
  if (!std::filesystem::is_directory(argv[1])) {
    std::fprintf(stderr, "cannot create the directory %s: %s\n", argv[1], error.message().c_str());
    std::exit(1);
  }
  return argv[1];
}

/// Three columns: name, value and unit ("-" for numbers and what has none). Times are kept elsewhere, so that
/// two runs write the same bytes.
class Summary {
 public:
  void add(const std::string& name, double value, const std::string& unit) {
    rows_.push_back({name, value, unit});
  }
  void write(const std::filesystem::path& file) const {
    std::ofstream out(file);
    out << "name,value,unit\n";
    for (const Row& row : rows_) {
      out << row.name << ',' << (row.value == row.value ? text("%.9g", row.value) : "nan") << ',' << row.unit
          << '\n';
    }
    if (!out.flush()) {
      std::fprintf(stderr, "cannot write %s\n", file.c_str());
      std::exit(1);
    }
  }

 private:
  struct Row {
    std::string name;
    double value;
    std::string unit;
  };
  std::vector<Row> rows_;
};

/// Columns as wide as their longest entry; the first flush left, the others right. What is wider than 110
/// characters is printed in parts, one below the other, each with the first column.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  void print() const {
    std::vector<std::size_t> widths(rows_.front().size());
    for (const auto& row : rows_) {
      for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
    }
    for (std::size_t first = 1; first == 1 || first < widths.size();) {
      std::size_t last = first, total = widths[0];
      while (last < widths.size() && (last == first || total + 2 + widths[last] <= widest))
        total += 2 + widths[last++];
      if (first > 1) std::printf("\n");
      print(widths, first, last);
      first = last;
    }
  }

 private:
  static constexpr std::size_t widest = 110;

  /// The first column, and those from `first` to before `last`.
  void print(const std::vector<std::size_t>& widths, std::size_t first, std::size_t last) const {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      std::string line = rows_[r][0] + std::string(widths[0] - width(rows_[r][0]), ' ');
      for (std::size_t i = first; i < std::min(last, rows_[r].size()); ++i)
        line += "  " + std::string(widths[i] - width(rows_[r][i]), ' ') + rows_[r][i];
      std::printf("%s\n", line.c_str());
      if (r == 0) std::printf("%s\n", std::string(width(line), '-').c_str());
    }
  }

  /// Characters, not bytes, of UTF-8.
  static std::size_t width(const std::string& s) {
    return static_cast<std::size_t>(
        std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  }

  std::vector<std::vector<std::string>> rows_;
};

}  // namespace demo
