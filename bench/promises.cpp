// SPDX-License-Identifier: BSD-3-Clause
// Time of what the promises cost: states that are known exactly, and bounds that do not act.
#include <benchmark/benchmark.h>

#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <string>
#include <vector>

#include "../tests/models/radar.hpp"
#include "../tests/models/van_der_pol.hpp"

namespace {

/// Five states that are driven, and the last, which is not: x⁺ = keep x.
struct Chain {
  static constexpr int states = 6;
  static constexpr bool linear = true;
  double keep = 1, last = 0;  // its variance a step
  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x) const {
    jml::Vector<T, 6> next = x;
    for (int i = 0; i < 4; ++i) next(i) += 0.1 * x(i + 1);
    next(4) = 0.9 * x(4) + x(5);
    next(5) = keep * x(5);
    return next;
  }
  jml::Matrix<double, 6, 6> disturbance_covariance() const {
    jml::Matrix<double, 6, 6> Q = 0.01 * jml::Matrix<double, 6, 6>::Identity();
    Q(5, 5) = last;
    return Q;
  }
};
struct First {
  static constexpr int measurements = 3;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    return x.template head<3>();
  }
  jml::Matrix<double, 3, 3> noise_covariance() const { return 0.1 * jml::Matrix<double, 3, 3>::Identity(); }
};

/// From P_0 = 1, of the last state `variance`.
void known_state(benchmark::State& state, double keep, double variance) {
  jml::Estimate<double, 6> start{jml::Vector<double, 6>::Ones(), jml::Matrix<double, 6, 6>::Identity()};
  start.P(5, 5) = variance;
  jml::Filter filter{jml::Ekf{}, Chain{keep, 0.01 * variance}, start};
  int i = 0;
  for (auto _ : state) {
    const auto report = filter.step(First{}, jml::Vector<double, 3>(std::sin(i), std::cos(i), 1));
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    benchmark::DoNotOptimize(filter);
    ++i;
  }
}

template <typename Method, typename D, typename S, int n, int p>
void window_step(benchmark::State& state, const Method& method, const D& d, const S& s,
                 const jml::Estimate<double, n>& start, const std::vector<jml::Vector<double, p>>& y) {
  jml::Filter filter{method, d, jml::sensors<S>, start};
  std::size_t i = 0;
  const auto next = [&] {
    const auto report = filter.step(s, y[i]);
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    i = i + 1 < y.size() ? i + 1 : 0;
    if (i == 0) filter.reset(start, 0);
  };
  for (int k = 0; k < 20; ++k) next();
  for (auto _ : state) next();
  benchmark::DoNotOptimize(filter);
}

/// A window without bounds, and with bounds of every state that no flight comes near.
template <typename D, typename S, int n>
void register_windows(const std::string& size, const D& d, const S& s,
                      const jml::Estimate<double, n>& start) {
  constexpr int p = S::measurements;
  std::vector<jml::Vector<double, p>> y;
  jml::Noise noise(1);
  jml::Vector<double, n> x = start.x;
  for (int k = 0; k < 600; ++k) {
    x = d.dynamics(x) + d.disturbance_input() * noise.normal_vector(d.disturbance_covariance());
    y.push_back(s.measurement(x) + noise.normal_vector(s.noise_covariance()));
  }
  jml::Bounds<n> far;
  far.lower.setConstant(-1e6);
  far.upper.setConstant(1e6);
  const auto add = [&](const char* name, const auto& method) {
    benchmark::RegisterBenchmark(
        (name + size).c_str(), [=](benchmark::State& state) { window_step(state, method, d, s, start, y); });
  };
  add("window_step/free/", jml::FixedLag<20>{});
  add("window_step/bounded/", jml::Bounded{jml::FixedLag<20>{}, far});
}

}  // namespace

void register_promises() {
  const auto add = [](const char* name, double keep, double variance) {
    benchmark::RegisterBenchmark(name, [=](benchmark::State& state) { known_state(state, keep, variance); });
  };
  add("known_state/n6/of_none", 1, 1);
  add("known_state/n6/constant", 1, 0);
  add("known_state/n6/moving", 0.999, 0);
  register_windows("n2", models::VanDerPol{}, models::SaturatingPosition{},
                   jml::Estimate<double, 2>{{1, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()});
  models::BallisticTarget level;
  level.gravity = 0;
  jml::Estimate<double, 6> start;
  start.x << 40, 25, 12, -0.4, 0.1, 0.02;
  start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  register_windows("n6", level, models::Radar{}, start);
}
