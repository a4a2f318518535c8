// SPDX-License-Identifier: BSD-3-Clause
// Time of one solution of the filter's algebraic Riccati equation, cold and from the last one, along a path
// of states that moves as a filter's estimate does in 10 ms.
#include <benchmark/benchmark.h>

#include <Eigen/LU>
#include <array>
#include <jml/continuous/algebraic.hpp>
#include <string>

#include "../tests/models/continuous.hpp"

namespace {

constexpr int samples = 64;

template <int n>
using Path = std::array<jml::AlgebraicRiccati<double, n, n>, samples>;

/// The SDDRE filter's equation along x(t), a circle of radius 1 in each position and velocity, 0.1 rad/s.
template <int n, typename D, typename S>
Path<n> along(const D& dynamics, const S& sensor) {
  Path<n> path;
  for (int i = 0; i < samples; ++i) {
    // There and back, so that the first state follows the last.
    const double angle = 1e-3 * (i < samples / 2 ? i : samples - i);
    jml::Vector<double, n> x;
    for (int k = 0; k < n; ++k) x(k) = std::sin(angle + 1 + k);
    const jml::Matrix<double, n, n> F = dynamics.dynamics_sdc(x);
    const auto M = sensor.measurement_sdc(x);
    const auto G = dynamics.disturbance_input();
    path[i] = {F, F.transpose(), G * dynamics.disturbance_spectral_density() * G.transpose(),
               M.transpose() * sensor.noise_spectral_density().inverse() * M};
  }
  return path;
}

/// A dense system: every entry of every coefficient moves.
template <int n>
Path<n> dense() {
  Path<n> path;
  for (int i = 0; i < samples; ++i) {
    const double angle = 1e-3 * (i < samples / 2 ? i : samples - i);
    jml::Matrix<double, n, n> A, G, M;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) {
        A(j, k) = std::sin(1 + 7 * j + 3 * k + 5 * j * k + angle) / 2;
        G(j, k) = k < 3 ? std::cos(2 + 5 * j + k + 3 * j * k + angle) : 0;
        M(j, k) = j < 6 ? std::cos(3 + j + 11 * k + 2 * j * k - angle) : 0;
      }
    }
    path[i] = {A, A.transpose(), G * G.transpose(), M.transpose() * M};
  }
  return path;
}

template <bool warm, int n>
void solve(benchmark::State& state, const Path<n>& path) {
  jml::Matrix<double, n, n> X = jml::solve_algebraic_riccati(path[samples - 1]).X;
  int i = 0;
  for (auto _ : state) {
    const auto solution =
        warm ? jml::solve_algebraic_riccati(path[i], X) : jml::solve_algebraic_riccati(path[i]);
    if (!jml::usable(solution.status) || solution.warm != warm)
      state.SkipWithError(jml::describe(solution.status));
    X = solution.X;
    benchmark::DoNotOptimize(X);
    i = (i + 1) % samples;
  }
}

template <int n>
void register_path(const std::string& size, const Path<n>& path) {
  benchmark::RegisterBenchmark(("care/cold/" + size).c_str(),
                               [path](benchmark::State& s) { solve<false, n>(s, path); });
  benchmark::RegisterBenchmark(("care/warm/" + size).c_str(),
                               [path](benchmark::State& s) { solve<true, n>(s, path); });
}

}  // namespace

void register_algebraic() {
  register_path<2>("n2", along<2>(models::Oscillator{}, models::SaturatingSignal{}));
  register_path<6>("n6", along<6>(models::OscillatorChain{}, models::SaturatingSignals{}));
  register_path<15>("n15", dense<15>());
}
