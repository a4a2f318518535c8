// SPDX-License-Identifier: BSD-3-Clause
#include "harness.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

// Every allocation of the process is counted, those of shared libraries included: malloc and its like are
// replaced by glibc's own under another name. operator new calls malloc.
namespace {
std::atomic<long> allocations{0};
}
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}
}

namespace peers {

namespace {

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "%s\n", what.c_str());
  std::exit(2);
}

/// Where count_instructions begins and ends to count.
void mark() {
#if defined(__x86_64__)
  asm volatile("int3" : : : "memory");
#else
  fail("instructions are counted on x86-64 alone");
#endif
}

/// Most memory that the process ever held, kB, libraries included. (getrusage would count that of its parent
/// too.)
long peak_kb() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::atol(line.c_str() + 6);
  }
  return 0;
}

void print(const char* name, const std::vector<double>& values) {
  std::printf(",\"%s\":[", name);
  for (std::size_t i = 0; i < values.size(); ++i) std::printf("%s%.17g", i == 0 ? "" : ",", values[i]);
  std::printf("]");
}

}  // namespace

Data::Data(const std::string& path) {
  std::ifstream in(path);
  if (!in) fail("cannot read " + path);
  const auto slash = path.find_last_of('/');
  contest_ = path.substr(slash == std::string::npos ? 0 : slash + 1);
  contest_ = contest_.substr(0, contest_.find_last_of('.'));
  std::string line, cell;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    if (!std::getline(cells, cell, ',') || cell.empty() || cell[0] == '#') continue;
    auto& row = rows_[cell].emplace_back();
    while (std::getline(cells, cell, ',')) row.push_back(std::strtod(cell.c_str(), nullptr));
  }
}

const std::vector<std::vector<double>>& Data::rows(const std::string& name) const {
  const auto found = rows_.find(name);
  if (found == rows_.end()) fail("no row " + name + " in the data of " + contest_);
  return found->second;
}

int run(int argc, char** argv, const char* name, Make make) {
  if (argc != 4) fail(std::string("usage: ") + argv[0] + " DATA STEPS REPEAT");
  const Data data(argv[1]);
  const long steps = std::atol(argv[2]);
  if (std::strcmp(argv[3], "count") == 0) {  // what differs between the two is steps - steps / 4 steps
    std::unique_ptr<Job>(make(data, steps))->run();
    for (const long some : {steps / 4, steps}) {
      const std::unique_ptr<Job> job(make(data, some));
      mark();
      job->run();
      mark();
    }
    return 0;
  }
  const long repeats = std::max(1L, std::atol(argv[3]));
  std::vector<double> times;
  Result result;
  long allocated = 0;
  for (long i = 0; i < repeats; ++i) {
    const std::unique_ptr<Job> job(make(data, steps));
    const long before = allocations;
    const auto start = std::chrono::steady_clock::now();
    job->run();
    const auto end = std::chrono::steady_clock::now();
    allocated = allocations - before;
    times.push_back(std::chrono::duration<double, std::nano>(end - start).count() /
                    static_cast<double>(steps));
    result = job->result();
  }
  std::sort(times.begin(), times.end());
#if defined(__clang__)
  const char* compiler = "clang++ " __clang_version__;
#else
  const char* compiler = "g++ " __VERSION__;
#endif
  std::printf("{\"contender\":\"%s\",\"contest\":\"%s\",\"compiler\":\"%s\",\"flags\":\"%s\"", name,
              data.contest().c_str(), compiler, JML_PEER_FLAGS);
  std::printf(",\"steps\":%ld,\"ns_per_step\":%.6g,\"allocations_per_step\":%.6g", steps,
              times[times.size() / 2], static_cast<double>(allocated) / static_cast<double>(steps));
  std::printf(",\"peak_kb\":%ld,\"state_bytes\":%zu,\"usable\":%s", peak_kb(), result.state_bytes,
              result.usable ? "true" : "false");
  for (const auto& [key, value] : result.more) std::printf(",\"%s\":%.17g", key.c_str(), value);
  print("x", result.x);
  print("P_diagonal", result.P_diagonal);
  std::printf("}\n");
  return 0;
}

}  // namespace peers
