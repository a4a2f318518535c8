// SPDX-License-Identifier: BSD-3-Clause
// Time of one filter step against the same step written by hand, all in one binary and on the same data.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <array>
#include <jml/jml.hpp>
#include <string>

#include "../tests/models/dense.hpp"
#include "../tests/models/radar.hpp"
#include "../tests/models/van_der_pol.hpp"
#include "iterated_limit.hpp"

namespace {

/// A model pair, a start and a period of 64 measurements around a nominal trajectory, repeated.
template <typename D, typename S>
struct Case {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> start;
  std::array<jml::Vector<double, p>, 64> y;
};

using VanDerPol = Case<models::VanDerPol, models::SaturatingPosition>;
using Radar = Case<models::BallisticTarget, models::Radar>;
using Dense = Case<models::DenseDynamics<15>, models::DenseSensor<15, 6>>;

VanDerPol make_n2() {
  VanDerPol c;
  c.start = {{0.5, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Vector<double, 2> x{1, 0};
  for (int i = 0; i < 64; ++i) {
    x = c.dynamics.dynamics(x);
    c.y[i] = c.sensor.measurement(x);
    c.y[i](0) += 0.1 * std::sin(7.0 * i);
  }
  return c;
}

Radar make_n6() {
  Radar c;
  c.dynamics.gravity = 0;  // a level track that 64 samples can repeat without ever reaching the ground
  jml::Vector<double, 6> x;
  x << 40, 25, 12, -0.4, 0.1, 0.02;
  c.start.x = x;
  c.start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  for (int i = 0; i < 64; ++i) {
    const double angle = 2 * 3.141592653589793 * i / 64;
    jml::Vector<double, 6> at = x;
    at(0) += 0.5 * std::sin(angle);
    at(1) += 0.5 * std::cos(angle);
    c.y[i] = c.sensor.measurement(at);
  }
  return c;
}

Dense make_n15() {
  Dense c;
  c.start.P = 0.1 * jml::Matrix<double, 15, 15>::Identity();
  jml::Vector<double, 15> x;
  for (int i = 0; i < 15; ++i) x(i) = std::sin(1.0 + i);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 15; ++j) x(j) = std::sin(1.0 + j + 2 * 3.141592653589793 * i / 64);
    c.y[i] = c.sensor.measurement(x);
  }
  return c;
}

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
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
