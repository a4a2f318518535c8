// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How far a campaign is (component jml::campaign), as a line on the terminal. POSIX.
#include <jml/warnings_begin.hpp>
#pragma once

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

namespace jml::detail {

/// How far a campaign is: runs that are done, `taken_over` of them from journals, in `seconds`.
struct ProgressCount {
  std::int64_t done = 0, taken_over = 0, all = 0;
  double seconds = 0;
};

/// One line of text. Runs are counted, not blocks; 100 % is said of all of them alone; how long it will still
/// take is told by the runs flown now, not by those taken over, and not before a second has passed.
inline std::string progress_line(const std::string& name, const ProgressCount& p) {
  constexpr int width = 20;
  const double share = static_cast<double>(p.done) / static_cast<double>(p.all);
  const auto filled = static_cast<std::size_t>(share * width);
  std::string line = name + " [" + std::string(filled, '#') + std::string(width - filled, '.') + "] " +
                     std::to_string(static_cast<int>(share * 100)) + " %, " + std::to_string(p.done) +
                     " of " + std::to_string(p.all) + " runs";
  if (p.taken_over > 0) line += " (" + std::to_string(p.taken_over) + " taken over)";
  const auto whole = [](double seconds) { return std::to_string(std::llround(seconds)) + " s"; };
  line += ", " + whole(p.seconds);
  if (p.done < p.all && p.done > p.taken_over && p.seconds >= 1)
    line +=
        ", about " +
        whole(p.seconds / static_cast<double>(p.done - p.taken_over) * static_cast<double>(p.all - p.done)) +
        " left";
  return line;
}

/// That line on stderr, written over four times a second at most; silent unless that is a terminal.
class Progress {
 public:
  Progress(bool wanted, std::string name)
      : on_(wanted && ::isatty(STDERR_FILENO) == 1), name_(std::move(name)) {}
  ~Progress() {
    if (shown_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(ProgressCount count) {
    if (!on_) return;
    const auto now = Clock::now();
    if (shown_ && now - last_ < std::chrono::milliseconds(250) && count.done < count.all) return;
    last_ = now;
    shown_ = true;
    count.seconds = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "\r%s\033[K", progress_line(name_, count).c_str());
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool on_, shown_ = false;
  std::string name_;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
