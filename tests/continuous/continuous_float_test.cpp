// SPDX-License-Identifier: BSD-3-Clause
// The fixed-step integrators in float, against the reference solutions.
#include <gtest/gtest.h>

#include "continuous/continuous_check.hpp"

namespace {

/// models::Oscillator and SaturatingSignal, with their constants in T.
struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const {
    jml::Matrix<T, 2, 2> F;
    F << T(0), T(1), T(-0.1), T(0.02) * (T(1) - x(0) * x(0));
    return F;
  }
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return dynamics_sdc(x) * x;
  }
  jml::Matrix<float, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<float, 1, 1> disturbance_spectral_density() const { return jml::Matrix<float, 1, 1>(1); }
};
struct Signal {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(T(1) + x(0) * x(0)));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return {T(1) / sqrt(T(1) + x(0) * x(0)), T(0)};
  }
  jml::Matrix<float, 1, 1> noise_spectral_density() const { return jml::Matrix<float, 1, 1>(1e-5f); }
};

template <typename Integrator, typename Rule, typename Samples>
double error(const Rule& rule, const Integrator& integrator, const Samples& samples) {
  const auto start = continuous_check::OscillatorCase::start();
  jml::Estimate<float, 2> single{start.x.cast<float>(), start.P.cast<float>()};
  jml::Filter filter{jml::Continuous{rule, integrator}, Plant{}, single};
  static_assert(std::is_same_v<decltype(filter.x()(0)), const float&>);
  double worst = 0;
  int step = 0;
  for (const auto& sample : samples) {
    for (; step < sample.time * 200 - 0.5; ++step) {
      const auto y = [](double t) {
        return jml::Vector<float, 1>(static_cast<float>(continuous_check::reference::oscillator_signal(t)));
      };
      if (filter.step(Signal{}, y, 0.005f).status != jml::Status::ok) return INFINITY;
    }
    worst =
        std::max(worst, continuous_check::distance(filter.estimate(), continuous_check::estimate_of(sample)));
  }
  return worst;
}

// Measured: 7e-6. ε = 6e-8, gains of 100 /s and a time step 0.005f that is off by 2e-8 relative.
TEST(ContinuousFloat, RungeKutta) {
  EXPECT_LT(error(jml::Rnls{}, jml::RungeKutta4{4}, continuous_check::OscillatorCase::rnls), 1e-4);
  EXPECT_LT(error(jml::Ekf{}, jml::RungeKutta4{4}, continuous_check::OscillatorCase::ekf), 1e-4);
}
TEST(ContinuousFloat, DavisonMaki) {  // measured: 8e-5, 2e-5 of it order 2 at 0.3 ms
  EXPECT_LT(error(jml::Rnls{}, jml::DavisonMaki{16}, continuous_check::OscillatorCase::rnls), 3e-4);
  EXPECT_LT(error(jml::Ekf{}, jml::DavisonMaki{16}, continuous_check::OscillatorCase::ekf), 3e-4);
}

}  // namespace
