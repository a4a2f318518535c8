// SPDX-License-Identifier: BSD-3-Clause
// The limit: plain loops over constant sizes, nothing checked and nothing reported. JML_PEER_LOOPS_JML: of
// the one-pass JML step, else of the EKF.
#include "../limit.hpp"
#include "step_contest.hpp"

namespace {

using peers::n, peers::p;

class Loops {
 public:
  explicit Loops(const peers::Contest& contest) : contest_(contest) {
    for (int i = 0; i < n; ++i) state_.x[i] = contest.x0(i);
    limit::copy(contest.P0, state_.P);
    limit::copy(contest.Q, Q_);
    limit::copy(contest.R, R_);
  }
  bool step(const peers::Measurement& y) {
#ifdef JML_PEER_LOOPS_JML
    limit::jml_step<n, p>(contest_.dynamics, contest_.sensor, Q_, R_, y, state_);
#else
    limit::ekf_step<n, p>(contest_.dynamics, contest_.sensor, Q_, R_, y, state_);
#endif
    return true;
  }
  [[nodiscard]] double x(int i) const { return state_.x[i]; }
  [[nodiscard]] double variance(int i) const { return state_.P[i][i]; }
  [[nodiscard]] static std::size_t state_bytes() { return sizeof(state_); }

 private:
  const peers::Contest& contest_;
  limit::State<n> state_{};
  limit::Square<n> Q_;
  limit::Square<p> R_;
};

}  // namespace

int main(int argc, char** argv) {
#ifdef JML_PEER_LOOPS_JML
  return peers::run_steps<Loops>(argc, argv, "loops_jml");
#else
  return peers::run_steps<Loops>(argc, argv, "loops_ekf");
#endif
}
