// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the system says of this process. getrusage() would not do: its peak is that of the caller's, before
/// exec, where that is larger.
#pragma once

#include <cstdio>
#include <string>

namespace scaling {

/// kB of an entry of /proc/self/status; -1 where there is none. "VmHWM": resident memory at its largest;
/// "RssAnon": resident memory that no file lies behind.
inline long kilobytes(const char* entry) {
  std::FILE* file = std::fopen("/proc/self/status", "r");
  if (file == nullptr) return -1;
  const std::string format = std::string(entry) + ": %ld";
  char line[256];
  long found = -1;
  while (std::fgets(line, sizeof line, file) != nullptr) std::sscanf(line, format.c_str(), &found);
  std::fclose(file);
  return found;
}

}  // namespace scaling
