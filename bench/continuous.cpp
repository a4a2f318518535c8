// SPDX-License-Identifier: BSD-3-Clause
// Time of one 10 ms sample of the continuous RNLS filter by each integrator, against a Runge-Kutta step
// written by hand; and of the algebraic Riccati solvers, cold and warm.
#include <benchmark/benchmark.h>

#include <array>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>
#ifdef JML_BENCH_CVODE
#include <jml/continuous/cvode.hpp>
#endif
#include <string>

#include "../tests/models/continuous.hpp"
#include "continuous_limit.hpp"

namespace {

constexpr double dt = 0.01;

/// A model pair, a start and the samples of one smooth period, which is repeated.
template <typename D, typename S>
struct Case {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  static constexpr int samples = 1024;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> start{jml::Vector<double, n>::Zero(),
                                 1e-3 * jml::Matrix<double, n, n>::Identity()};
  std::array<jml::Vector<double, p>, samples + 1> y;

  Case() {
    for (int i = 0; i <= samples; ++i) {
      const double angle = 2 * 3.141592653589793 * i / samples;
      for (int j = 0; j < p; ++j) y[i](j) = 0.6 * std::sin(angle + j) + 0.1 * std::cos(3 * angle);
    }
  }
};

template <typename Case, typename Integrator, typename Signal>
void library_sample(benchmark::State& state, const Case& c, const Integrator& integrator,
                    const Signal& signal) {
  jml::Filter filter{jml::Continuous{jml::Rnls{}, integrator}, c.dynamics, c.start};
  long evaluations = 0;
  int i = 0;
  for (auto _ : state) {
    const auto report = filter.step(c.sensor, signal(c, i), dt);
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    benchmark::DoNotOptimize(filter);
    evaluations += report.evaluations;
    i = (i + 1) % Case::samples;
  }
  state.counters["evaluations"] =
      benchmark::Counter(static_cast<double>(evaluations), benchmark::Counter::kAvgIterations);
}

template <typename Case>
void limit_sample(benchmark::State& state, const Case& c) {
  constexpr int n = Case::n, p = Case::p;
  limit::FlowState<n> z;
  double noise[n][n], inverse_R[p];
  const jml::Matrix<double, n, n> GQG = c.dynamics.disturbance_input() *
                                        c.dynamics.disturbance_spectral_density() *
                                        c.dynamics.disturbance_input().transpose();
  for (int i = 0; i < n; ++i) {
    z.x[i] = c.start.x(i);
    for (int j = 0; j < n; ++j) {
      z.P[i][j] = c.start.P(i, j);
      noise[i][j] = GQG(i, j);
    }
  }
  for (int i = 0; i < p; ++i) inverse_R[i] = 1 / c.sensor.noise_spectral_density()(i, i);
  int i = 0;
  for (auto _ : state) {
    limit::rnls_sample<n, p>(c.dynamics, c.sensor, noise, inverse_R, c.y[i], dt, z);
    benchmark::DoNotOptimize(z);
    i = (i + 1) % Case::samples;
  }
}

template <typename Case>
void register_case(const std::string& size, const Case& c) {
  const auto held = [](const Case& k, int i) { return k.y[i]; };
  const auto add = [&](const std::string& name, auto run) {
    benchmark::RegisterBenchmark((name + "/" + size).c_str(), run);
  };
  add("rnls_limit", [c](benchmark::State& s) { limit_sample(s, c); });
  add("rnls_sample/rk4", [c, held](benchmark::State& s) { library_sample(s, c, jml::RungeKutta4{}, held); });
  add("rnls_sample/davison_maki",
      [c, held](benchmark::State& s) { library_sample(s, c, jml::DavisonMaki{}, held); });
#ifdef JML_BENCH_CVODE
  const auto line = [](const Case& k, int i) { return jml::Line(k.y[i], k.y[i + 1]); };
  const jml::Cvode adams{}, bdf{{.method = jml::CvodeMethod::bdf}};
  add("rnls_sample/cvode_adams_restart", [=](benchmark::State& s) { library_sample(s, c, adams, held); });
  add("rnls_sample/cvode_adams_interpolated",
      [=](benchmark::State& s) { library_sample(s, c, adams, line); });
  add("rnls_sample/cvode_bdf", [=](benchmark::State& s) { library_sample(s, c, bdf, held); });
#endif
}

}  // namespace

void register_continuous() {
  register_case("n2", Case<models::Oscillator, models::SaturatingSignal>{});
  register_case("n6", Case<models::OscillatorChain, models::SaturatingSignals>{});
}
