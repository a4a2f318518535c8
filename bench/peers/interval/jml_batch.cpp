// SPDX-License-Identifier: BSD-3-Clause
// jml::Batch: the least J of a flight, from where an EKF was.
#include "contest.hpp"

namespace {

using namespace peers;
using Problem = JML_PEER_PROBLEM;

class Library : public Job {
 public:
  Library(const Data& data, long steps)
      : flight_(read_flight<Problem>(data, steps)),
        batch_{problem_.dynamics,
               jml::sensors<decltype(problem_.sensor)>,
               problem_.prior,
               {static_cast<int>(steps)}} {
    batch_.options.tolerance = Problem::step;
    batch_.start = jml::Start::given;
    batch_.guess(flight_.start[0]);
    for (int k = 0; k < flight_.steps(); ++k) {
      if (step(batch_, problem_, flight_, k) != jml::Status::ok) std::exit(2);
      batch_.guess(flight_.start[static_cast<std::size_t>(k) + 1]);
    }
  }
  void run() override { report_ = batch_.solve(); }
  [[nodiscard]] Result result() const override {
    Result out = result_of_batch(
        problem_, flight_, [this](std::size_t k) { return batch_.x(static_cast<int>(k)); },
        report_.iterations);
    out.usable = out.usable && jml::usable(report_.status);
    return out;
  }

 private:
  Problem problem_;
  Flight<Problem::n, Problem::p, Problem::u> flight_;
  jml::Batch<decltype(Problem::dynamics), jml::Sensors<decltype(Problem::sensor)>> batch_;
  jml::BatchReport<double> report_;
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "jml_batch", [](const Data& d, long n) -> Job* { return new Library(d, n); });
}
