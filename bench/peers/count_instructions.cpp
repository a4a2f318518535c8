// SPDX-License-Identifier: BSD-3-Clause
// count_instructions PROGRAM ARGUMENT…: runs PROGRAM and prints how many instructions it executes between its
// first and second breakpoint instruction (int3), its third and fourth, and so on: one number a line. The
// processor is stepped one instruction at a time, so the count is exact, and any instruction that this
// processor knows is counted, those of AVX-512 too. x86-64 on Linux.
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace {

/// The signal that stopped `child`; ends the program where it has ended.
int wait_for(pid_t child) {
  int status = 0;
  if (waitpid(child, &status, 0) < 0) std::exit(3);
  if (WIFEXITED(status)) std::exit(WEXITSTATUS(status));
  if (WIFSIGNALED(status)) std::exit(4);
  return WSTOPSIG(status);
}

/// A breakpoint, and not the end of a single step.
bool at_breakpoint(pid_t child) {
  siginfo_t what{};
  ptrace(PTRACE_GETSIGINFO, child, nullptr, &what);
  return what.si_code == SI_KERNEL || what.si_code == TRAP_BRKPT;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const pid_t child = fork();
  if (child == 0) {
    ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    execvp(argv[1], argv + 1);
    std::perror(argv[1]);
    return 127;
  }
  wait_for(child);  // stopped at its first instruction
  long signal = 0;
  for (;;) {
    ptrace(PTRACE_CONT, child, nullptr, signal);
    signal = wait_for(child);
    if (signal != SIGTRAP) continue;
    signal = 0;
    long count = 0;
    for (;;) {
      ptrace(PTRACE_SINGLESTEP, child, nullptr, nullptr);
      if (const int stop = wait_for(child); stop != SIGTRAP) std::exit(5);
      if (at_breakpoint(child)) break;
      ++count;
    }
    std::printf("%ld\n", count);
    std::fflush(stdout);
  }
}
