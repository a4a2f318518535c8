// SPDX-License-Identifier: BSD-3-Clause
// The harness around no estimator: what is subtracted from the size of a contender. JML_PEER_PROBLEM: a
// flight read, its start judged; JML_PEER_N: a signal read.
#ifdef JML_PEER_PROBLEM
#include "contest.hpp"
#else
#include "continuous_contest.hpp"
#endif

namespace {

using namespace peers;

#ifdef JML_PEER_PROBLEM
class Nothing : public Job {
 public:
  Nothing(const Data& data, long steps) : flight_(read_flight<JML_PEER_PROBLEM>(data, steps)) {}
  void run() override { keep(flight_); }
  [[nodiscard]] Result result() const override {
    return result_of_batch(problem_, flight_, [this](std::size_t k) { return flight_.start[k]; }, 0);
  }

 private:
  JML_PEER_PROBLEM problem_;
  Flight<JML_PEER_PROBLEM::n, JML_PEER_PROBLEM::p, JML_PEER_PROBLEM::u> flight_;
};
#else
class Nothing : public Job {
 public:
  Nothing(const Data& data, long steps) : y_(read_signal(data, steps)) {}
  void run() override { keep(y_); }
  [[nodiscard]] Result result() const override {
    return result_of_sample(State::Zero(), Square::Identity(), true);
  }

 private:
  std::vector<Measurement> y_;
};
#endif

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "nothing", [](const Data& d, long n) -> Job* { return new Nothing(d, n); });
}
