// SPDX-License-Identifier: BSD-3-Clause
// Puts what a program printed into a file of stored results, or compares it with one.
//
//   collect store FILE KIND SOURCE...      writes FILE, and says what has changed by more than the scatter of
//   its kind collect compare FILE KIND SOURCE...    exit code 1 where the two do not agree
//
// KIND and SOURCE:
//   summary OTHER_FILE            the summary.csv of a demo
//   timing OTHER_FILE             its timing.csv
//   figures PROGRAM ARGUMENT...   runs it, and reads its lines "figure: NAME = VALUE (UNIT)"
//   bare_metal PROGRAM ...        runs it, and reads the lines of tests/bare_metal/target.cpp
//   code_size PROGRAM ...         runs it, the size program of the cross compiler, and reads its first column
//   compile_cost PROGRAM ...      runs it, and reads the ratios of bench/compile/measure.cpp
//   bench RESULTS.json            the medians of Google Benchmark
//
// What is computed must agree to four digits, less than 1e-9 being rounding; the counts of instructions to
// one in a hundred, as another compiler of the same series makes them. Times scatter: a ratio of compile
// times by a tenth, what the benchmarks and demos take by a third where the machine is shared.
#include <sys/wait.h>

#include <algorithm>
#include <cctype>

#include "results.hpp"

namespace {

using guide::Table;

/// What the program prints, shown as well; empty where it fails.
std::optional<std::string> output_of(char** words, int count, const char* and_errors) {
  std::string command;
  for (int i = 0; i < count; ++i) command += std::string(i > 0 ? " '" : "'") + words[i] + "'";
  command += and_errors;
  FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::string out;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) {
    out += static_cast<char>(c);
    std::putchar(c);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return out;
  std::printf("failed: %s\n", command.c_str());
  return std::nullopt;
}

/// "EKF, n = 6" as a name: ekf_n_6.
std::string name_of(const std::string& words) {
  std::string out;
  for (const char c : words) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      out += static_cast<char>(std::tolower(c));
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

template <typename Read>
Table by_lines(const std::string& text, const Read& read) {
  Table out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) read(line, out);
  return out;
}

void figure(const std::string& line, Table& out) {
  char name[200], unit[40];
  double value = 0;
  if (std::sscanf(line.c_str(), "figure: %199s = %lg (%39[^)])", name, &value, unit) == 3)
    out.push_back({name, value, unit});
}

void bare_metal(const std::string& line, Table& out) {
  const auto ok = line.find(" ok ");
  double difference = 0, instructions = 0, stack = 0;
  if (ok == std::string::npos ||
      std::sscanf(line.c_str() + line.find(':', ok),
                  ": largest difference from the host %lg (tolerance %*g), %*d heap calls, "
                  "%lg instructions a step, stack %lg",
                  &difference, &instructions, &stack) != 3)
    return;
  const std::string name = name_of(line.substr(0, ok));
  out.push_back({name + "_instructions", instructions, "-"});
  out.push_back({name + "_stack", stack, "bytes"});
  out.push_back({name + "_difference", difference, "-"});
}

void code_size(const std::string& line, Table& out) {
  double text = 0, data = 0;
  char path[400];
  if (std::sscanf(line.c_str(), "%lg %lg %*g %*g %*s %399s", &text, &data, path) == 3 && data == 0) {
    const std::string stem = std::filesystem::path(path).filename().string();
    out.push_back({stem.substr(0, stem.find('.')), text, "bytes"});
  }
}

void compile_cost(const std::string& line, Table& out) {
  double seconds = 0, megabytes = 0, ratio = 0;
  char path[400];
  if (std::sscanf(line.c_str(), "%lg %lg %lg %399s", &seconds, &megabytes, &ratio, path) == 4)
    out.push_back({std::filesystem::path(path).stem().string(), ratio, "-"});
}

/// Processor time in ns, or the time on the clock where the benchmark is registered so; and its counters; by
/// name, as the benchmarks are run in a random order.
Table bench(const std::string& json) {
  Table out;
  std::string name;
  bool median = false, counters = false;  // these stand last
  double real = 0, processor = 0;
  std::istringstream lines(json.substr(std::min(json.find("\"benchmarks\""), json.size())));
  for (std::string line; std::getline(lines, line);) {
    const auto open = line.find('"'), close = line.find("\":", open + 1);
    if (line.find('{') != std::string::npos) {
      name.clear();
      median = counters = false;
    }
    if (open == std::string::npos || close == std::string::npos) continue;
    const std::string key = line.substr(open + 1, close - open - 1);
    std::string value = line.substr(close + 3);
    if (value.ends_with(",")) value.pop_back();
    if (value.starts_with("\"")) value = value.substr(1, value.size() - 2);
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    if (key == "run_name")
      name = value;
    else if (key == "aggregate_name")
      median = value == "median";
    else if (key == "real_time")
      real = number;
    else if (key == "cpu_time")
      processor = number;
    else if (key == "time_unit" && median) {
      const double unit = value == "ms" ? 1e6 : value == "us" ? 1e3 : value == "s" ? 1e9 : 1;
      const bool by_clock = name.ends_with("_time");
      if (by_clock) name = name.substr(0, name.rfind('/'));
      out.push_back({name, unit * (by_clock ? real : processor), "ns"});
      counters = true;
    } else if (counters && *end == '\0' && end != value.c_str() && std::isfinite(number)) {
      out.push_back({name + "." + key, number, "-"});
    }
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

struct Kind {
  const char* name;
  double relative, absolute;
};
constexpr Kind kinds[] = {{"summary", 1e-4, 1e-9},     {"figures", 1e-4, 1e-9}, {"bare_metal", 1e-2, 1e-9},
                          {"compile_cost", 0.1, 0.05}, {"bench", 0.33, 0},      {"code_size", 1e-2, 0},
                          {"timing", 0.33, 0}};

/// Says which rows do not agree, and counts them.
int differences(const Table& stored, const Table& fresh, const Kind& kind) {
  std::map<std::string, double> there;
  for (const auto& row : fresh) there[row.name] = row.value;
  int count = 0;
  for (const auto& row : stored) {
    const auto found = there.find(row.name);
    if (found == there.end()) {
      std::printf("%s: stored, and no longer printed\n", row.name.c_str());
      ++count;
      continue;
    }
    const double a = row.value, b = found->second;
    const bool agree = a == b || (std::isnan(a) && std::isnan(b)) ||
                       std::abs(a - b) <= kind.absolute + kind.relative * std::max(std::abs(a), std::abs(b));
    if (!agree) {
      std::printf("%s: stored %.9g, now %.9g\n", row.name.c_str(), a, b);
      ++count;
    }
    there.erase(found);
  }
  for (const auto& [name, value] : there) {
    if (!stored.empty()) std::printf("%s: printed, and not stored\n", name.c_str());
    ++count;
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 4 ? argv[1] : "", name = argc > 4 ? argv[3] : "";
  const auto* const kind =
      std::find_if(std::begin(kinds), std::end(kinds), [&](const Kind& k) { return name == k.name; });
  if ((what != "store" && what != "compare") || kind == std::end(kinds))
    return std::fputs("collect store|compare FILE KIND SOURCE... (see the source)\n", stderr), 2;
  Table fresh;
  if (name == "summary" || name == "timing") {
    fresh = guide::read_table(argv[4]);
  } else if (name == "bench") {
    fresh = bench(guide::contents(argv[4]));
  } else {
    const auto printed =
        output_of(argv + 4, argc - 4, name == "bare_metal" ? " 2>&1" : "");  // where QEMU prints
    if (!printed) return 1;
    fresh = by_lines(*printed, name == "figures"      ? figure
                               : name == "bare_metal" ? bare_metal
                               : name == "code_size"  ? code_size
                                                      : compile_cost);
  }
  if (fresh.empty()) return std::printf("no results in what %s gave\n", argv[4]), 1;
  const int count = differences(guide::read_table(argv[2]), fresh, *kind);  // of a new file: all
  std::printf("%s: %zu results, %d %s\n", argv[2], fresh.size(), count,
              what == "store" ? "new, gone or beyond the scatter" : "do not agree");
  if (what == "compare") return count == 0 ? 0 : 1;
  return guide::write_table(argv[2], fresh) ? 0 : 1;
}
