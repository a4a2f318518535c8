// SPDX-License-Identifier: BSD-3-Clause
// Time of one step of the bounded-noise estimator beside the EKF's, on the same models and data.
#include <benchmark/benchmark.h>

#include <array>
#include <jml/jml.hpp>
#include <string>

#include "../tests/models/radar.hpp"
#include "../tests/models/van_der_pol.hpp"

namespace {

// The models of steps.cpp with bounds of uniform noise of the same variance.
struct Oscillator : models::VanDerPol {
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(std::sqrt(3 * q_c / dt)); }
};
struct Position : models::SaturatingPosition {
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(std::sqrt(3 * r)); }
};
struct Target : models::BallisticTarget {
  jml::Vector<double, 3> disturbance_bound() const {
    return jml::Vector<double, 3>::Constant(std::sqrt(3 * acceleration_variance));
  }
};
struct BoundedRadar : models::Radar {
  jml::Vector<double, 3> noise_bound() const {
    return std::sqrt(3.0) * jml::Vector<double, 3>(range_sd, angle_sd, angle_sd);
  }
};

template <typename D, typename S>
struct Case {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  D dynamics;
  S sensor;
  jml::Vector<double, n> x, reach;
  std::array<jml::Vector<double, p>, 64> y;
};

Case<Oscillator, Position> make_n2() {
  Case<Oscillator, Position> c;
  c.dynamics.q_c = 0.05;
  c.sensor.r = 1e-4;  // at r = 0.02 the box runs away into where the sensor saturates
  c.x = {0.5, 0};
  c.reach = {0.2, 0.2};
  jml::Vector<double, 2> x = c.x;
  for (int i = 0; i < 64; ++i) {
    x = c.dynamics.dynamics(x);
    c.y[static_cast<std::size_t>(i)] = c.sensor.measurement(x);
  }
  return c;
}

Case<Target, BoundedRadar> make_n6() {
  Case<Target, BoundedRadar> c;
  c.dynamics.gravity = 0;
  c.x << 40, 25, 12, -0.4, 0.1, 0.02;
  c.reach.setConstant(0.05);
  jml::Vector<double, 6> x = c.x;
  for (int i = 0; i < 64; ++i) {
    x = c.dynamics.dynamics(x);
    c.y[static_cast<std::size_t>(i)] = c.sensor.measurement(x);
  }
  return c;
}

template <typename Case, typename Make>
void steps(benchmark::State& state, const Case& c, const Make& make) {
  auto filter = make(c);
  std::size_t i = 0;
  for (auto _ : state) {
    const auto report = filter.step(c.sensor, c.y[i]);
    if (report.status != jml::Status::ok) state.SkipWithError(jml::describe(report.status));
    benchmark::DoNotOptimize(filter);
    if (++i == 64) {  // the track starts again: 1/64 of a copy
      i = 0;
      filter = make(c);
    }
  }
}

template <typename Case>
void register_case(const std::string& size, const Case& c) {
  const auto box = [](const Case& of) { return jml::Box{of.x - of.reach, of.x + of.reach}; };
  const auto add = [&](const char* name, auto make) {
    benchmark::RegisterBenchmark((std::string("bounded_step/") + size + name).c_str(),
                                 [c, make](benchmark::State& state) { steps(state, c, make); });
  };
  add("/ekf", [](const Case& of) {
    return jml::Filter{jml::Ekf{}, of.dynamics,
                       jml::Estimate{of.x, of.reach.cwiseAbs2().asDiagonal().toDenseMatrix() / 3}};
  });
  add("/linearised", [box](const Case& of) { return jml::Filter{jml::Linearised{}, of.dynamics, box(of)}; });
  add("/guaranteed", [box](const Case& of) { return jml::Filter{jml::Guaranteed{}, of.dynamics, box(of)}; });
  add("/guaranteed_box",
      [box](const Case& of) { return jml::Filter{jml::Guaranteed<0>{}, of.dynamics, box(of)}; });
  add("/paved", [box](const Case& of) { return jml::Filter{jml::Paved<8>{}, of.dynamics, box(of)}; });
}

[[maybe_unused]] const bool registered = [] {
  register_case("n2", make_n2());
  register_case("n6", make_n6());
  return true;
}();

}  // namespace
