// SPDX-License-Identifier: BSD-3-Clause
// jml::Filter with the method that JML_PEER_METHOD names.
#include <jml/filter/factored.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/iterated/iterated.hpp>

#include "step_contest.hpp"

namespace {

#define JML_PEER_EKF 1
#define JML_PEER_FACTORED_EKF 2
#define JML_PEER_JML 3
#define JML_PEER_ITERATED_JML 4
#if JML_PEER_METHOD == JML_PEER_EKF
constexpr const char* name = "jml_ekf";
auto method() { return jml::Ekf{}; }
#elif JML_PEER_METHOD == JML_PEER_FACTORED_EKF
constexpr const char* name = "jml_factored_ekf";
auto method() { return jml::Factored{jml::Ekf{}}; }
#elif JML_PEER_METHOD == JML_PEER_JML
constexpr const char* name = "jml_one_pass";
auto method() { return jml::Jml{}; }
#else
constexpr const char* name = "jml_iterated";
constexpr jml::IterationOptions options{.tolerance = 1e-10};
// About the origin the radar's SDC makes P indefinite within a few steps.
#if JML_PEER_N == 6
auto method() { return jml::IteratedJml{jml::AboutEstimate{}, options}; }
#else
auto method() { return jml::IteratedJml{options}; }
#endif
#endif

class Library {
 public:
  explicit Library(const peers::Contest& contest)
      : sensor_(contest.sensor), filter_{method(), contest.dynamics, jml::Estimate{contest.x0, contest.P0}} {}
  bool step(const peers::Measurement& y) { return jml::usable(filter_.step(sensor_, y).status); }
  [[nodiscard]] double x(int i) const { return filter_.x()(i); }
  [[nodiscard]] double variance(int i) const { return filter_.P()(i, i); }
  [[nodiscard]] static std::size_t state_bytes() { return sizeof(Filter) - sizeof(peers::Dynamics); }

 private:
  using Filter = decltype(jml::Filter{method(), std::declval<const peers::Contest&>().dynamics,
                                      jml::Estimate{peers::State{}, peers::Square{}}});
  const peers::Sensor& sensor_;
  Filter filter_;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_steps<Library>(argc, argv, name); }
