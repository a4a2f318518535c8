// SPDX-License-Identifier: BSD-3-Clause
// The harness around no filter: what is subtracted from the size of a contender.
#include "step_contest.hpp"

namespace {

class Nothing {
 public:
  explicit Nothing(const peers::Contest& contest) : contest_(contest), x_(contest.x0) {}
  bool step(const peers::Measurement& y) {
    x_(0) += y(0);
    return true;
  }
  [[nodiscard]] double x(int i) const { return x_(i); }
  [[nodiscard]] double variance(int i) const { return contest_.P0(i, i); }
  [[nodiscard]] static std::size_t state_bytes() { return 0; }

 private:
  const peers::Contest& contest_;
  peers::State x_;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_steps<Nothing>(argc, argv, "nothing"); }
