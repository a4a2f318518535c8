// SPDX-License-Identifier: BSD-3-Clause
// The batch of the Van der Pol oscillator in loops written for this one model (bench/batch_limit.hpp).
#include "../../batch_limit.hpp"
#include "contest.hpp"

namespace {

using namespace peers;

class Loops : public Job {
 public:
  Loops(const Data& data, long steps)
      : flight_(read_flight<VanDerPolProblem>(data, steps)),
        batch_(problem_.dynamics, problem_.sensor, problem_.prior) {
    batch_.nodes.resize(flight_.start.size());
    for (std::size_t k = 0; k < flight_.start.size(); ++k) {
      batch_.nodes[k].x[0][0] = flight_.start[k](0);
      batch_.nodes[k].x[0][1] = flight_.start[k](1);
      if (k > 0) batch_.nodes[k].y = flight_.y[k - 1](0);
    }
  }
  void run() override { batch_.solve(VanDerPolProblem::step, true); }
  [[nodiscard]] Result result() const override {
    return result_of_batch(
        problem_, flight_,
        [this](std::size_t k) { return jml::Vector<double, 2>(batch_.x(k)[0], batch_.x(k)[1]); },
        batch_.iterations);
  }

 private:
  VanDerPolProblem problem_;
  Flight<2, 1, 0> flight_;
  limit::Batch batch_;
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "loops_batch", [](const Data& d, long n) -> Job* { return new Loops(d, n); });
}
