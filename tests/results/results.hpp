// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stored results: files <name>.csv of one directory, each with rows "name,value,unit" as the demos write
/// them; and how a page writes one of their numbers.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace guide {

inline std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Row {
  std::string name;
  double value;
  std::string unit;
};
using Table = std::vector<Row>;

/// The rows of one file; empty where there is none. The header line is asked for.
inline Table read_table(const std::filesystem::path& file) {
  std::istringstream in(contents(file));
  std::string line;
  Table out;
  if (!std::getline(in, line) || line != "name,value,unit") return out;
  while (std::getline(in, line)) {
    const auto first = line.find(','), last = line.rfind(',');
    if (first == std::string::npos || last == first) return {};
    out.push_back(
        {line.substr(0, first), std::strtod(line.c_str() + first + 1, nullptr), line.substr(last + 1)});
  }
  return out;
}

inline bool write_table(const std::filesystem::path& file, const Table& table) {
  std::ofstream out(file);
  out << "name,value,unit\n";
  for (const Row& row : table) {
    char value[40];
    std::snprintf(value, sizeof value, "%.9g", row.value);
    out << row.name << ',' << value << ',' << row.unit << '\n';
  }
  return static_cast<bool>(out.flush());
}

/// All files of the directory, by "<file>:<name>".
class Results {
 public:
  explicit Results(const std::filesystem::path& directory) {
    for (const auto& entry : std::filesystem::directory_iterator(directory)) {
      if (entry.path().extension() != ".csv") continue;
      for (const Row& row : read_table(entry.path()))
        values_[entry.path().stem().string() + ":" + row.name] = row.value;
    }
  }
  std::optional<double> operator[](const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) return std::nullopt;
    return found->second;
  }

 private:
  std::map<std::string, double> values_;
};

/// Five digits and more in groups of three, as the pages write them.
inline std::string grouped(std::string text) {
  const std::size_t start = text[0] == '-' ? 1 : 0, dot = std::min(text.find('.'), text.size());
  if (dot - start < 5) return text;
  for (std::size_t at = dot - 3; at > start && at < text.size(); at -= 3) {
    text.insert(at, " ");
    if (at < start + 3) break;
  }
  return text;
}

/// ".2": two decimals. "3g": three significant digits, never with an exponent. "e1": 1.2e-13.
inline std::optional<std::string> written(double value, const std::string& format) {
  char buffer[64];
  if (format.size() < 2 || !std::isfinite(value)) return std::nullopt;
  if (format[0] == '.') {
    std::snprintf(buffer, sizeof buffer, "%.*f", std::atoi(format.c_str() + 1), value);
    return grouped(buffer);
  }
  if (format[0] == 'e') {
    std::snprintf(buffer, sizeof buffer, "%.*e", std::atoi(format.c_str() + 1), value);
    std::string text = buffer;
    const auto e = text.find('e');
    return text.substr(0, e + 1) + std::to_string(std::atoi(text.c_str() + e + 1));
  }
  if (format.back() == 'g') {
    const int digits = std::atoi(format.c_str());
    std::snprintf(buffer, sizeof buffer, "%.*e", digits - 1, value);  // rounds 9.996 to 10.0, not 10.00
    const int exponent = std::atoi(std::string(buffer).substr(std::string(buffer).find('e') + 1).c_str());
    std::snprintf(buffer, sizeof buffer, "%.*f", std::max(0, digits - 1 - exponent),
                  std::strtod(buffer, nullptr));
    return grouped(buffer);
  }
  return std::nullopt;
}

/// "a / b min c .2": names or numbers with * / + - min max between them, and the format; from left to right,
/// but min and max first: a over the lesser of b and c. Empty, with the reason in `why`, where something is
/// not known.
inline std::optional<std::string> evaluated(const std::string& expression, const Results& results,
                                            std::string& why) {
  std::istringstream in(expression);
  const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
  if (words.size() < 2 || words.size() % 2 != 0) return why = "not an expression and a format", std::nullopt;
  std::vector<std::pair<std::string, double>> terms;  // an operation and what it is done with
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    char* end = nullptr;
    double operand = std::strtod(words[i].c_str(), &end);
    if (*end != '\0') {
      const auto stored = results[words[i]];
      if (!stored) return why = "no stored result " + words[i], std::nullopt;
      operand = *stored;
    }
    const std::string by = i == 0 ? "+" : words[i - 1];
    if (by == "min")
      terms.back().second = std::fmin(terms.back().second, operand);
    else if (by == "max")
      terms.back().second = std::fmax(terms.back().second, operand);
    else
      terms.emplace_back(by, operand);
  }
  double value = 0;
  for (const auto& [by, operand] : terms) {
    if (by == "*")
      value *= operand;
    else if (by == "/")
      value /= operand;
    else if (by == "+")
      value += operand;
    else if (by == "-")
      value -= operand;
    else
      return why = "unknown operation " + by, std::nullopt;
  }
  auto text = written(value, words.back());
  if (!text) why = "not finite, or no format " + words.back();
  return text;
}

}  // namespace guide
