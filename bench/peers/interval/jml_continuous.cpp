// SPDX-License-Identifier: BSD-3-Clause
// jml::Continuous{jml::Ekf{}} with the integrator that JML_PEER_INTEGRATOR names.
#include <jml/jml.hpp>
#ifdef JML_PEER_CVODE
#include <jml/continuous/cvode.hpp>
#endif

#include "continuous_contest.hpp"

namespace {

using namespace peers;

auto make() {
  return jml::Filter{jml::Continuous{jml::Ekf{}, jml::JML_PEER_INTEGRATOR{}}, Oscillating{},
                     jml::Estimate<double, n>{State::Zero(), 1e-3 * Square::Identity()}};
}

class Library : public Job {
 public:
  Library(const Data& data, long steps) : y_(read_signal(data, steps)) {}
  void run() override {
    for (const auto& y : y_) usable_ = jml::usable(filter_.step(sensor_, y, sample).status) && usable_;
  }
  [[nodiscard]] Result result() const override {
    Result out = result_of_sample(filter_.x(), filter_.P(), usable_);
    out.state_bytes = sizeof filter_ - sizeof(Oscillating);
    return out;
  }

 private:
  std::vector<Measurement> y_;
  Signal sensor_;
  decltype(make()) filter_ = make();
  bool usable_ = true;
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, JML_PEER_NAME, [](const Data& d, long n) -> Job* { return new Library(d, n); });
}
