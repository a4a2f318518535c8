// SPDX-License-Identifier: BSD-3-Clause
// jml::FixedLag<20>, a step at a time. JML_PEER_CONVERGED: every window to the end, else the two sweeps of a
// step. JML_PEER_GAUSS_NEWTON: without second derivatives, as gtsam's. Compared are the newest states.
#include "contest.hpp"

namespace {

using namespace peers;
using Problem = JML_PEER_PROBLEM;

class Library : public Job {
 public:
  Library(const Data& data, long steps)
      : flight_(read_flight<Problem>(data, steps)),
        filter_{jml::FixedLag<20>{}, problem_.dynamics, jml::sensors<decltype(problem_.sensor)>,
                problem_.prior},
        x_(flight_.y.size()) {
    for (const auto& row : data.rows("truth"))
      flight_.truth.push_back(Eigen::Map<const jml::Vector<double, Problem::n>>(row.data()));
#ifdef JML_PEER_CONVERGED
    filter_.method().options.sweeps = 50;
    filter_.method().options.tolerance = 1e-8;
#endif
#ifdef JML_PEER_GAUSS_NEWTON
    filter_.method().options.newton = false;
#endif
  }
  void run() override {
    for (int k = 0; k < flight_.steps(); ++k) {
      const auto report = step(filter_, problem_, flight_, k);
      usable_ = usable_ && jml::usable(report.status);
      sweeps_ += report.sweeps;
      x_[static_cast<std::size_t>(k)] = filter_.x();
    }
  }
  [[nodiscard]] Result result() const override {
    Result out;
    const std::size_t steps = x_.size(), stride = std::max<std::size_t>(1, steps / 32);
    for (std::size_t k = steps / 2 - 1; k < steps; k += stride) {
      for (int i = 0; i < Problem::n; ++i) out.x.push_back(x_[k](i));
    }
    double sum = 0;
    for (std::size_t k = 0; k < steps; ++k) {
      for (int i = 0; i < 2; ++i) sum += std::pow(x_[k](i) - flight_.truth[k + 1](i), 2);
    }
    const auto count = static_cast<double>(steps);
    out.more = {{"rmse", std::sqrt(sum / count)}, {"iterations", sweeps_ / count}};
    out.state_bytes = sizeof filter_ - sizeof problem_.dynamics;
    out.usable = usable_;
    return out;
  }

 private:
  Problem problem_;
  Flight<Problem::n, Problem::p, Problem::u> flight_;
  using Filter = decltype(jml::Filter{jml::FixedLag<20>{}, Problem::dynamics,
                                      jml::sensors<decltype(Problem::sensor)>, Problem::prior});
  Filter filter_;
  std::vector<jml::Vector<double, Problem::n>> x_;
  double sweeps_ = 0;
  bool usable_ = true;
};

}  // namespace

int main(int argc, char** argv) {
#ifdef JML_PEER_CONVERGED
  const char* name = "jml_lag_converged";
#elif defined(JML_PEER_GAUSS_NEWTON)
  const char* name = "jml_lag_gauss_newton";
#else
  const char* name = "jml_lag";
#endif
  return run(argc, argv, name, [](const Data& d, long n) -> Job* { return new Library(d, n); });
}
