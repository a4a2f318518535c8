// SPDX-License-Identifier: BSD-3-Clause
// What compiling costs: runs commands of a compile_commands.json again, one at a time, and prints the
// processor time and the peak memory of each. With tests' cost data, what the tests take, too.
//
//   measure compile_commands.json [--match text]... [--except text]... [--repeat n] [--relative-to text]
//           [--tests CTestCostData.txt]
//
// --match: only files whose path holds one of the texts; --except: none of these. --repeat: the least time of
// n runs. --relative-to: a column of ratios to the file whose path holds the text. --at-most text:ratio: the
// most that ratio may be for the file whose path holds the text. Exit code 1 where it is more, or where a
// file does not compile.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace {

struct Entry {
  std::string directory, command, file;
  double seconds = 0;  // processor time, user and system
  long megabytes = 0;
  bool compiled = true;
};

/// The string that starts after the quote at `at`, unescaped.
std::string string_at(const std::string& json, std::size_t at) {
  std::string out;
  for (++at; at < json.size() && json[at] != '"'; ++at) {
    if (json[at] == '\\') ++at;
    out += json[at];
  }
  return out;
}

/// CMake writes one object after the other, each with these three strings.
std::vector<Entry> read(const char* path) {
  std::ifstream in(path);
  const std::string json{std::istreambuf_iterator<char>(in), {}};
  std::vector<Entry> entries;
  for (std::size_t open = json.find('{'); open != std::string::npos; open = json.find("\n{", open + 1)) {
    const auto value = [&](const char* key) {
      const std::size_t at = json.find(key, open);
      return at == std::string::npos ? std::string{} : string_at(json, json.find('"', json.find(':', at)));
    };
    entries.push_back({value("\"directory\""), value("\"command\""), value("\"file\"")});
  }
  return entries;
}

void run(Entry& entry) {
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(entry.directory.c_str()) == 0)
      execl("/bin/sh", "sh", "-c", ("exec " + entry.command).c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  const double time = seconds(used.ru_utime) + seconds(used.ru_stime);
  entry.seconds = entry.seconds > 0 ? std::min(entry.seconds, time) : time;
  entry.megabytes = std::max(entry.megabytes, used.ru_maxrss / 1024);
  entry.compiled &= WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Name, runs, and mean seconds of each test, as CTest keeps them between runs.
void print_tests(const char* path) {
  std::ifstream in(path);
  struct Test {
    std::string name;
    double seconds;
  };
  std::vector<Test> tests;
  std::string name, runs;
  double seconds = 0, sum = 0;
  while (in >> name && name != "---" && in >> runs >> seconds) {
    tests.push_back({name, seconds});
    sum += seconds;
  }
  std::sort(tests.begin(), tests.end(), [](const Test& a, const Test& b) { return a.seconds > b.seconds; });
  std::printf("\n%zu tests, %.1f s in all; the dearest:\n", tests.size(), sum);
  for (std::size_t i = 0; i < tests.size() && i < 30; ++i)
    std::printf("%8.2f s  %s\n", tests[i].seconds, tests[i].name.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2)
    return std::fputs("measure compile_commands.json [--match text]... (see the source)\n", stderr), 2;
  std::vector<std::string> matches, exceptions, limits;
  std::string unit;
  const char* tests = nullptr;
  int repeat = 1;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string option = argv[i];
    if (option == "--match") matches.emplace_back(argv[i + 1]);
    if (option == "--except") exceptions.emplace_back(argv[i + 1]);
    if (option == "--repeat") repeat = std::max(1, std::atoi(argv[i + 1]));
    if (option == "--relative-to") unit = argv[i + 1];
    if (option == "--at-most") limits.emplace_back(argv[i + 1]);
    if (option == "--tests") tests = argv[i + 1];
  }
  std::vector<Entry> entries = read(argv[1]);
  std::erase_if(entries, [&](const Entry& e) {
    const auto in_file = [&e](const std::string& text) { return has(e.file, text); };
    return (!matches.empty() && std::none_of(matches.begin(), matches.end(), in_file)) ||
           std::any_of(exceptions.begin(), exceptions.end(), in_file);
  });
  double sum = 0, reference = 0;
  long most = 0;
  for (int k = 0; k < repeat; ++k) {
    for (Entry& entry : entries) {
      run(entry);
      std::fprintf(stderr, "%7.2f s %5ld MB  %s\n", entry.seconds, entry.megabytes, entry.file.c_str());
    }
  }
  bool all = true;
  for (const Entry& entry : entries) {
    sum += entry.seconds;
    most = std::max(most, entry.megabytes);
    all &= entry.compiled;
    if (!unit.empty() && has(entry.file, unit)) reference = entry.seconds;
  }
  if (unit.empty())
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.seconds > b.seconds; });
  std::printf("%8s %8s%s  file\n", "CPU s", "peak MB", unit.empty() ? "" : "    ratio");
  for (const Entry& entry : entries) {
    std::printf("%8.2f %8ld", entry.seconds, entry.megabytes);
    if (!unit.empty()) std::printf(" %8.2f", entry.seconds / reference);
    std::printf("  %s%s", entry.file.c_str(), entry.compiled ? "" : "  (does not compile)");
    for (const std::string& limit : limits) {
      const auto colon = limit.find(':');
      const double most_allowed = std::atof(limit.c_str() + colon + 1);
      if (!has(entry.file, limit.substr(0, colon)) || entry.seconds <= most_allowed * reference) continue;
      std::printf("  (more than %.2f)", most_allowed);
      all = false;
    }
    std::puts("");
  }
  std::printf("%zu files, %.1f s of processor time, at most %ld MB\n", entries.size(), sum, most);
  if (tests != nullptr) print_tests(tests);
  return all ? 0 : 1;
}
