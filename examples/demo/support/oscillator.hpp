// SPDX-License-Identifier: BSD-3-Clause
// What the demos of the continuous filters share: the oscillator of both papers of Rusnak under band-limited
// noise, a filter's run along it, and the papers' figures of such a run.
//
// "White in a 100 rad/s bandwidth": independent normal samples of variance density / T, each held for T =
// π/100 s or as near to it as the grid allows. Their Nyquist frequency is 100 rad/s.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <jml/campaign/noise.hpp>
#include <jml/continuous/continuous.hpp>
#include <models/continuous.hpp>
#include <string>
#include <vector>

#include "figure.hpp"

namespace demo {

using State = jml::Vector<double, 2>;
using Riccati = jml::Matrix<double, 2, 2>;

inline double output(const State& x) { return models::SaturatingPosition{}.measurement(x)(0); }

/// The truth on a grid of times i dt, and the measurement noise v from i dt to (i + 1) dt.
struct Track {
  double dt = 0;
  std::vector<State> x;   // steps + 1
  std::vector<double> v;  // steps + 1
  [[nodiscard]] std::size_t steps() const { return x.size() - 1; }
  [[nodiscard]] double y(std::size_t i) const { return output(x[i]) + v[i]; }            // from i dt on
  [[nodiscard]] double y_until(std::size_t i) const { return output(x[i]) + v[i - 1]; }  // up to i dt
};

/// Held noise: two densities, samples of the grid for which a value is held, and a seed; none without.
struct HeldNoise {
  double driving_density, measurement_density;
  std::size_t held;
  std::uint64_t seed;
};

/// x' = f(x) + G w from `start`, w constant over dt, by the classical Runge-Kutta method in `parts` steps.
inline Track simulate(const models::Oscillator& oscillator, const State& start, double dt, std::size_t steps,
                      const HeldNoise* noise = nullptr, int parts = 1) {
  Track out{dt, {start}, {}};
  jml::Noise normal(noise != nullptr ? noise->seed : 0);
  State x = start;
  double w = 0, v = 0;
  const double h = dt / parts;
  const auto slope = [&](const State& z) {
    return State(oscillator.dynamics(z) + State(0, w / oscillator.mu));
  };
  for (std::size_t i = 0; i <= steps; ++i) {
    if (noise != nullptr && i % noise->held == 0) {
      const double period = dt * static_cast<double>(noise->held);
      w = std::sqrt(noise->driving_density / period) * normal.normal();
      v = std::sqrt(noise->measurement_density / period) * normal.normal();
    }
    out.v.push_back(v);
    if (i == steps) break;
    for (int part = 0; part < parts; ++part) {
      const State a = slope(x), b = slope(x + h / 2 * a), c = slope(x + h / 2 * b), d = slope(x + h * c);
      x += h / 6 * (a + 2 * b + 2 * c + d);
    }
    out.x.push_back(x);
  }
  return out;
}

/// What becomes of the samples of y between two of them.
enum class Between { held, line };

/// Runs a filter over a track, a sample every `stride` points of its grid: y is held from each sample to the
/// next, or a line between them. `observe(i, report)` after each step, which ends at point i of the grid.
/// Answers the number of refused steps.
template <typename Filter, typename Sensor, typename Observer>
int follow(Filter& filter, const Sensor& sensor, const Track& track, std::size_t stride, Between between,
           const Observer& observe) {
  const double dt = track.dt * static_cast<double>(stride);
  int refused = 0;
  for (std::size_t i = stride; i <= track.steps(); i += stride) {
    const double from = track.y(i - stride), to = track.y_until(i);
    const auto report = between == Between::held ? filter.step(sensor, from, dt)
                                                 : filter.step(sensor, jml::Line{from, to}, dt);
    refused += report.status != jml::Status::ok;
    observe(i, report);
  }
  return refused;
}

/// The curves of one run, thinned to what a figure shows.
struct History {
  std::size_t every = 1;  ///< and twenty times as many at the start
  std::vector<double> t{}, y{}, y_hat{}, x{}, x_hat{}, v{}, v_hat{}, k1{}, k2{}, p11{}, p12{}, p21{}, p22{};

  template <typename Filter, typename Report>
  void record(const Track& track, std::size_t i, const Filter& filter, const Report& report) {
    if (i % (i < 20 * every ? std::max<std::size_t>(every / 20, 1) : every) != 0) return;
    add(track.dt * static_cast<double>(i), track.y_until(i), track.x[i], filter, report.gain(0),
        report.gain(1));
  }

  /// t = 0, before the first sample: the gain P m_xᵀ/R of a filter in continuous time.
  template <typename Filter>
  void begin(const Track& track, const Filter& filter, double R) {
    const double slope = models::SaturatingPosition{}.measurement_jacobian(State(filter.x()))(0) / R;
    add(0, track.y(0), track.x[0], filter, filter.P()(0, 0) * slope, filter.P()(1, 0) * slope);
  }

  template <typename Filter>
  void add(double time, double measured, const State& truth, const Filter& filter, double gain_1,
           double gain_2) {
    t.push_back(time);
    y.push_back(measured);
    y_hat.push_back(output(filter.x()));
    x.push_back(truth(0));
    v.push_back(truth(1));
    x_hat.push_back(filter.x()(0));
    v_hat.push_back(filter.x()(1));
    k1.push_back(gain_1);
    k2.push_back(gain_2);
    p11.push_back(filter.P()(0, 0));
    p12.push_back(filter.P()(0, 1));
    p21.push_back(filter.P()(1, 0));
    p22.push_back(filter.P()(1, 1));
  }
  static std::vector<double> minus(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> out;
    for (std::size_t i = 0; i < a.size(); ++i) out.push_back(a[i] - b[i]);
    return out;
  }
  [[nodiscard]] Series line(const char* label, const char* ink, const std::vector<double>& values,
                            const char* style = "lines lw 1.5") const {
    return {label, ink, t, values, style};
  }

  static constexpr const char* dashed = "lines lw 1.8 dt (8,5)";
  [[nodiscard]] std::vector<Panel> output_panels() const {
    return {
        {"output y (-)",
         {line("measured", colour::sky, y, "lines lw 1"), line("estimated", colour::red, y_hat, dashed)}}};
  }
  [[nodiscard]] std::vector<Panel> position_panels() const {
    return {
        {"position ξ (-)", {line("true", colour::black, x), line("estimated", colour::red, x_hat, dashed)}}};
  }
  [[nodiscard]] std::vector<Panel> velocity_panels() const {
    return {
        {"velocity (1/s)", {line("true", colour::black, v), line("estimated", colour::red, v_hat, dashed)}}};
  }
  [[nodiscard]] std::vector<Panel> gain_panels() const {
    return {{"K₁ = P₁₁ mₓ / R (1/s)", {line("", colour::blue, k1)}},
            {"K₂ = P₂₁ mₓ / R (1/s²)", {line("", colour::red, k2)}}};
  }
  [[nodiscard]] std::vector<Panel> riccati_panels() const {
    return {{"P₁₁ (-)", {line("", colour::blue, p11)}},
            {"P₁₂, P₂₁ (1/s)", {line("P₁₂", colour::blue, p12), line("P₂₁", colour::red, p21, dashed)}},
            {"P₁₂ - P₂₁ (1/s)", {line("", colour::purple, minus(p12, p21))}},
            {"P₂₂ (1/s²)", {line("", colour::blue, p22)}}};
  }
};

/// fig<number><part>.svg, as high as its panels want it.
inline void write_figure(const std::filesystem::path& directory, int number, const std::string& title,
                         std::vector<Panel> panels, const std::string& caption,
                         const std::string& x_title = "time (s)", int height = 0,
                         const std::string& part = "") {
  char name[16];
  std::snprintf(name, sizeof name, "fig%02d", number);
  if (height == 0) height = panels.size() == 1 ? 480 : 200 + 220 * static_cast<int>(panels.size());
  Figure{"Fig. " + std::to_string(number) + "  " + title, x_title, std::move(panels), 900, height}.write(
      directory / (name + part + ".svg"), caption);
}

}  // namespace demo
