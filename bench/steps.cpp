// SPDX-License-Identifier: BSD-3-Clause
// Time of one filter step against the same step written by hand, all in one binary and on the same data.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <jml/jml.hpp>
#include <string>

#include "cases.hpp"
#include "iterated_limit.hpp"
#include "limit.hpp"

namespace {

using cases::make_n15, cases::make_n2, cases::make_n6;

template <typename Rule, typename Case>
void library_step(benchmark::State& state, const Rule& rule, const Case& c) {
  jml::Filter filter{rule, c.dynamics, c.start};
  int i = 0;
  for (auto _ : state) {
    const auto report = filter.step(c.sensor, c.y[i]);
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    benchmark::DoNotOptimize(filter);
    i = (i + 1) % 64;
  }
}

template <bool symmetric, typename Case>
void limit_step(benchmark::State& state, const Case& c) {
  constexpr int n = Case::n, p = Case::p;
  limit::State<n> estimate;
  Eigen::Map<jml::Vector<double, n>>(estimate.x) = c.start.x;
  limit::copy(c.start.P, estimate.P);
  limit::Square<n> noise;
  limit::Square<p> R;
  const bool valid = jml::ProcessNoise<double, decltype(c.dynamics)>(c.dynamics)
                         .with(c.dynamics, c.start.x, jml::StepContext<double>{},
                               [&](const auto& GQG) { limit::copy(GQG, noise); });
  if (!valid) state.SkipWithError("Q is no covariance");
  limit::copy(jml::Matrix<double, p, p>(c.sensor.noise_covariance()), R);
  int i = 0;
  for (auto _ : state) {
    if constexpr (symmetric)
      limit::ekf_step<n, p>(c.dynamics, c.sensor, noise, R, c.y[i], estimate);
    else
      limit::jml_step<n, p>(c.dynamics, c.sensor, noise, R, c.y[i], estimate);
    benchmark::DoNotOptimize(estimate);
    i = (i + 1) % 64;
  }
}

/// The exact step by hand: the same sweeps, and the SDC matrices of P that the rule has.
template <typename Case, typename Iterated>
void iterated_limit_step(benchmark::State& state, const Case& c, const Iterated& iterated) {
  constexpr int n = Case::n, p = Case::p;
  limit::State<n> estimate;
  Eigen::Map<jml::Vector<double, n>>(estimate.x) = c.start.x;
  limit::copy(c.start.P, estimate.P);
  limit::Square<n> noise;
  limit::Square<p> R, R_inverse;
  const jml::StepContext<double> at{};
  const bool valid = jml::ProcessNoise<double, decltype(c.dynamics)>(c.dynamics)
                         .with(c.dynamics, c.start.x, at, [&](const auto& GQG) { limit::copy(GQG, noise); });
  if (!valid) state.SkipWithError("Q is no covariance");
  const jml::Matrix<double, p, p> given = c.sensor.noise_covariance();
  limit::copy(given, R);
  limit::copy(jml::Matrix<double, p, p>(given.llt().solve(jml::Matrix<double, p, p>::Identity())), R_inverse);
  const auto F = [&](const auto& d, const auto& x, const auto& about) {
    return jml::dynamics_slot<jml::Slot::sdc>(iterated.inner, d, x, about, at);
  };
  const auto M = [&](const auto& s, const auto& x, const auto& about) {
    return jml::sensor_slot<jml::Slot::sdc>(iterated.inner, s, x, about, at);
  };
  int i = 0;
  for (auto _ : state) {
    const int sweeps = limit::iterated_step<n, p>(c.dynamics, c.sensor, noise, R, R_inverse, c.y[i],
                                                  iterated.options.tolerance, F, M, estimate);
    if (sweeps < 0) state.SkipWithError("not converged");
    benchmark::DoNotOptimize(estimate);
    i = (i + 1) % 64;
  }
}

/// The EKF step as one writes it in fixed-size Eigen, nothing checked and nothing reported.
template <typename Case>
void eigen_step(benchmark::State& state, const Case& c) {
  constexpr int n = Case::n, p = Case::p;
  using Square = jml::Matrix<double, n, n>;
  auto estimate = c.start;
  Square noise = Square::Zero();
  const bool valid =
      jml::ProcessNoise<double, decltype(c.dynamics)>(c.dynamics)
          .with(c.dynamics, c.start.x, jml::StepContext<double>{}, [&](const auto& GQG) { noise = GQG; });
  if (!valid) state.SkipWithError("Q is no covariance");
  const jml::Matrix<double, p, p> R = c.sensor.noise_covariance();
  int i = 0;
  for (auto _ : state) {
    const Square A = c.dynamics.dynamics_jacobian(estimate.x);
    const jml::Vector<double, n> x = c.dynamics.dynamics(estimate.x);
    const Square N = A * estimate.P * A.transpose() + noise;
    const jml::Matrix<double, p, n> H = c.sensor.measurement_jacobian(x);
    const jml::Matrix<double, n, p> NH = N * H.transpose();
    const jml::Matrix<double, p, p> S = H * NH + R;
    const jml::Matrix<double, n, p> K = S.llt().solve(NH.transpose()).transpose();
    estimate.x = x + K * (c.y[i] - c.sensor.measurement(x));
    const Square P = N - K * NH.transpose();
    estimate.P = (P + P.transpose()) / 2;
    benchmark::DoNotOptimize(estimate);
    i = (i + 1) % 64;
  }
}

template <typename Case, typename Iterated>
void register_case(const std::string& size, const Case& c, const Iterated& iterated) {
  const auto add = [&](const char* name, auto run) {
    benchmark::RegisterBenchmark((name + size).c_str(), run);
  };
  add("limit_step/", [c](benchmark::State& s) { limit_step<true>(s, c); });
  add("eigen_step/", [c](benchmark::State& s) { eigen_step(s, c); });
  add("ekf_step/", [c](benchmark::State& s) { library_step(s, jml::Ekf{}, c); });
  add("factored_ekf_step/", [c](benchmark::State& s) { library_step(s, jml::Factored{jml::Ekf{}}, c); });
  add("jml_limit_step/", [c](benchmark::State& s) { limit_step<false>(s, c); });
  add("jml_step/", [c](benchmark::State& s) { library_step(s, jml::Jml{}, c); });
  add("iterated_limit_step/", [c, iterated](benchmark::State& s) { iterated_limit_step(s, c, iterated); });
  add("iterated_jml_step/", [c, iterated](benchmark::State& s) { library_step(s, iterated, c); });
}

}  // namespace

void register_continuous();  // continuous.cpp
void register_algebraic();   // algebraic.cpp
void register_deep();        // deep.cpp
void register_promises();    // promises.cpp

int main(int argc, char** argv) {
  const jml::IterationOptions options{.tolerance = 1e-10};
  register_case("n2", make_n2(), jml::IteratedJml{options});
  // About the origin the radar's SDC makes P indefinite within a few steps; the derived one about the
  // estimate costs eight Jacobians of each model a step.
  register_case("n6", make_n6(), jml::IteratedJml{jml::AboutEstimate{}, options});
  register_case("n15", make_n15(), jml::IteratedJml{options});
  register_continuous();
  register_algebraic();
  register_deep();
  register_promises();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
