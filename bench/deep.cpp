// SPDX-License-Identifier: BSD-3-Clause
// Time of the deeper estimators: the whole interval against a sweep written by hand and against Ceres, from
// the same start to the same gradient, and a step of the fixed-lag filter.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <string>
#include <vector>
#ifdef JML_BENCH_CERES
#include <jml/interval/ceres.hpp>
#endif

#include "../tests/models/radar.hpp"
#include "batch_limit.hpp"

namespace {

using State = jml::Vector<double, 2>;
using Batch = jml::Batch<models::VanDerPolWhite, jml::Sensors<models::SaturatingPosition>>;

const models::VanDerPolWhite oscillator;
const models::SaturatingPosition sensor;
const jml::Estimate<double, 2> prior{State(1.5, 0.5), 0.1 * jml::Matrix<double, 2, 2>::Identity()};

/// A flight with both noises, and where an EKF was at each step: the start of every engine.
struct Flight {
  std::vector<double> y;
  std::vector<State> start;

  explicit Flight(int steps) {
    jml::Noise noise(1);
    State x(1, 0);
    jml::Filter ekf{jml::Ekf{}, oscillator, prior};
    start.push_back(prior.x);
    for (int k = 0; k < steps; ++k) {
      x = oscillator.dynamics(x) + noise.normal_vector(oscillator.disturbance_covariance());
      y.push_back(sensor.measurement(x)(0) + std::sqrt(sensor.r) * noise.normal());
      if (!jml::usable(ekf.step(sensor, y.back()).status)) std::abort();
      start.push_back(ekf.x());
    }
  }
};

std::size_t heap_in_use() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

Batch recorded(const Flight& flight) {
  Batch batch{
      oscillator, jml::sensors<models::SaturatingPosition>, prior, {static_cast<int>(flight.y.size())}};
  batch.start = jml::Start::given;
  batch.guess(flight.start[0]);
  for (std::size_t k = 0; k < flight.y.size(); ++k) {
    if (batch.step(sensor, flight.y[k]) != jml::Status::ok) std::abort();
    batch.guess(flight.start[k + 1]);
  }
  return batch;
}

/// The EKF's states again, in place of the last answer.
void restart(Batch& batch, const Flight& flight) {
  auto& store = batch.recording();
  for (int j = 0; j <= store.last(); ++j)
    store.node(j).x[store.now()] = flight.start[static_cast<std::size_t>(j)];
}

void count(benchmark::State& state, int iterations, double gradient, double bytes) {
  const auto steps = static_cast<double>(state.range(0));
  state.counters["iterations"] = iterations;
  state.counters["gradient"] = gradient;
  state.counters["bytes_per_step"] = bytes / steps;
  state.counters["s_per_step_and_iteration"] = benchmark::Counter(
      steps * iterations, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void batch_jml(benchmark::State& state, bool newton) {
  const Flight flight(static_cast<int>(state.range(0)));
  const std::size_t before = heap_in_use();
  Batch batch = recorded(flight);
  const std::size_t after = heap_in_use();
  batch.options.newton = newton;
  jml::BatchReport<double> report;
  for (auto _ : state) {
    restart(batch, flight);
    report = batch.solve();
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
  }
  count(state, report.iterations, report.gradient, static_cast<double>(after - before));
}

void batch_limit(benchmark::State& state, bool newton) {
  const Flight flight(static_cast<int>(state.range(0)));
  limit::Batch batch(oscillator, sensor, prior);
  const std::size_t before = heap_in_use();
  batch.nodes.resize(flight.start.size());
  const std::size_t after = heap_in_use();
  for (std::size_t k = 0; k < flight.y.size(); ++k) batch.nodes[k + 1].y = flight.y[k];
  for (auto _ : state) {
    for (std::size_t k = 0; k < flight.start.size(); ++k) {
      batch.nodes[k].x[0][0] = flight.start[k](0);
      batch.nodes[k].x[0][1] = flight.start[k](1);
    }
    batch.solve(1e-10, newton);
    benchmark::DoNotOptimize(batch.cost);
  }
  count(state, batch.iterations, std::numeric_limits<double>::quiet_NaN(),
        static_cast<double>(after - before));
}

/// One step of a fixed-lag filter, two sweeps, no early stop; as in the table of the lag demo.
template <int L, typename D, typename S, int n, int p>
void fixed_lag_step(benchmark::State& state, const D& d, const S& s, const jml::Estimate<double, n>& start,
                    const std::vector<jml::Vector<double, p>>& y) {
  jml::Filter filter{jml::FixedLag<L>{}, d, jml::sensors<S>, start};
  filter.method().options.tolerance = 0;
  std::size_t i = 0;
  const auto next = [&] {
    const auto report = filter.step(s, y[i]);
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    i = i + 1 < y.size() ? i + 1 : 0;
    if (i == 0) filter.reset(start, 0);
  };
  for (int k = 0; k < L; ++k) next();
  for (auto _ : state) next();
  benchmark::DoNotOptimize(filter);
}

template <typename D, typename S, int n, int p>
void register_lags(const std::string& size, const D& d, const S& s, const jml::Estimate<double, n>& start,
                   const std::vector<jml::Vector<double, p>>& y) {
  const auto add = [&](const char* lag, auto run) {
    benchmark::RegisterBenchmark((std::string("fixed_lag_step/") + lag + "/" + size).c_str(), run);
  };
  add("L5", [=](benchmark::State& state) { fixed_lag_step<5>(state, d, s, start, y); });
  add("L20", [=](benchmark::State& state) { fixed_lag_step<20>(state, d, s, start, y); });
  add("L100", [=](benchmark::State& state) { fixed_lag_step<100>(state, d, s, start, y); });
}

void register_n2() {
  const models::VanDerPol d;
  std::vector<jml::Vector<double, 1>> y;
  jml::Noise noise(1);
  State x(1, 0);
  for (int k = 0; k < 4096; ++k) {
    x = d.dynamics(x) + d.disturbance_input() * noise.normal_vector(d.disturbance_covariance());
    y.push_back(sensor.measurement(x) + noise.normal_vector(sensor.noise_covariance()));
  }
  register_lags("n2", d, sensor, prior, y);
}

void register_n6() {
  models::BallisticTarget d;
  d.gravity = 0;  // a level track
  const models::Radar radar;
  jml::Estimate<double, 6> start;
  start.x << 40, 25, 12, -0.4, 0.1, 0.02;
  start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  std::vector<jml::Vector<double, 3>> y;
  jml::Noise noise(1);
  jml::Vector<double, 6> x = start.x;
  for (int k = 0; k < 600; ++k) {
    x = d.dynamics(x) + d.disturbance_input() * noise.normal_vector(d.disturbance_covariance());
    y.push_back(radar.measurement(x) + noise.normal_vector(radar.noise_covariance()));
  }
  register_lags("n6", d, radar, start, y);
}

#ifdef JML_BENCH_CERES
/// The time inside ceres::Solve alone, without the building of its problem. `best`: analytic Jacobians and a
/// trust region that begins wide open; else one that begins at Ceres' own 1e4.
void batch_ceres(benchmark::State& state, bool best) {
  const Flight flight(static_cast<int>(state.range(0)));
  Batch batch = recorded(flight);
  jml::CeresOptions options;
  options.gradient_tolerance = 1e-8;
  if (!best)
    options.solver.initial_trust_region_radius = ceres::Solver::Options().initial_trust_region_radius;
  jml::CeresReport report;
  for (auto _ : state) {
    restart(batch, flight);
    report = jml::solve_with_ceres(batch, options);
    if (!jml::usable(report.status)) state.SkipWithError(jml::describe(report.status));
    state.SetIterationTime(report.last.total_time_in_seconds);
  }
  count(state, report.iterations, report.gradient, std::numeric_limits<double>::quiet_NaN());
}
#endif

}  // namespace

void register_deep() {
  const auto add = [](const char* name, auto run, int last) {
    auto* benchmark = benchmark::RegisterBenchmark(name, run);
    for (int steps = 100; steps <= last; steps *= 10) benchmark->Arg(steps);
    benchmark->Unit(benchmark::kMicrosecond);
    return benchmark;
  };
  add("batch/jml", [](benchmark::State& s) { batch_jml(s, true); }, 1000000);
  add("batch/jml_gauss_newton", [](benchmark::State& s) { batch_jml(s, false); }, 1000000);
  add("batch/limit", [](benchmark::State& s) { batch_limit(s, false); }, 1000000);
  add("batch/limit_newton", [](benchmark::State& s) { batch_limit(s, true); }, 1000000);
#ifdef JML_BENCH_CERES
  add("batch/ceres", [](benchmark::State& s) { batch_ceres(s, true); }, 100000)->UseManualTime();
  add("batch/ceres_default", [](benchmark::State& s) { batch_ceres(s, false); }, 100000)->UseManualTime();
#endif
  register_n2();
  register_n6();
}
