// SPDX-License-Identifier: BSD-3-Clause
// Many runs of the bounded-noise estimator and of the Kalman filter on the same data, and their mean squared
// errors as curves.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <jml/bounded/bounded_noise.hpp>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <string>
#include <vector>

#include "dissertation.hpp"
#include "figure.hpp"
#include "statistics.hpp"

namespace demo::dissertation {

inline constexpr int source_runs = 100;

/// Squared errors of one state at one sample, over all runs.
struct Errors {
  Mean bounded{}, kalman{}, difference{}, on_line{};  ///< bounded - Kalman; the box's own (2.34)
  double optimum = 0;                                 ///< the Kalman filter's P
  double optimum_all = 0;                             ///< of one that uses the first sample as well
};

/// What the mean of the source's 100 runs scatters by.
inline double scatter(const Mean& mean) {
  return mean.standard_error() * std::sqrt(mean.count() / static_cast<double>(source_runs));
}

template <typename D>
struct Campaign {
  static constexpr int n = D::states;
  using State = jml::Vector<double, n>;
  D system;
  double r;                     ///< variance of the measurement noise
  State variance;               ///< of the state at t = 0, uniform
  State prior;                  ///< half width of the first box, about 0
  int samples;                  ///< with that at t = 0
  int first = 0;                ///< sample to be recorded
  bool bang_bang = false;       ///< u = ± its standard deviation
  bool keep_campaigns = false;  ///< of 100 runs each

  std::vector<std::array<Errors, n>> errors{};              ///< of each sample recorded
  std::vector<std::vector<std::array<double, n>>> means{};  ///< of the Kalman filter: campaign, sample, state
  int refused = 0;                                          ///< steps
  int violated = 0;                                         ///< measurements that left no box
  int outside = 0;                                          ///< boxes without the truth

  void run(int runs, std::uint64_t seed) {
    jml::Noise noise(seed);
    const FirstState<n> sensor{r};
    const double deviation = std::sqrt(system.variance), reach = bound_of(system.variance);
    const jml::Vector<double, n> G = system.disturbance_input();
    const jml::Estimate<double, n> start{State::Zero(), jml::Matrix<double, n, n>(variance.asDiagonal())};
    errors.assign(static_cast<std::size_t>(samples - first), {});
    optima(sensor, start);
    for (int run = 0; run < runs; ++run) {
      if (keep_campaigns && run % source_runs == 0) means.emplace_back(errors.size());
      State x;
      for (int i = 0; i < n; ++i) x(i) = noise.uniform(-1, 1) * bound_of(variance(i));
      jml::Filter bounded{jml::Linearised{}, system, jml::Box<double, n>{-prior, prior}};
      jml::Filter kalman{jml::Kalman{}, system, start};
      for (int k = 0; k < samples; ++k) {
        if (k > 0) {
          const double u = noise.uniform(-1, 1);
          x = system.dynamics(x) + G * (bang_bang ? std::copysign(deviation, u) : u * reach);
        }
        const double y = x(0) + noise.uniform(-1, 1) * sensor.bound;
        const auto report = k == 0 ? bounded.update(sensor, y) : bounded.step(sensor, y);
        refused += !jml::usable(report.status);
        violated += report.status == jml::Status::accepted_without_measurement;
        if (k > 0) refused += !jml::usable(kalman.step(sensor, y).status);
        if (k >= first) record(static_cast<std::size_t>(k - first), x, bounded, kalman);
      }
    }
  }

 private:
  void record(std::size_t k, const State& x, const auto& bounded, const auto& kalman) {
    outside += !bounded.box().contains(x);
    const State of_bounded = (bounded.x() - x).cwiseAbs2(), of_kalman = (kalman.x() - x).cwiseAbs2();
    const State on_line = bounded.box().error_variance();
    for (int i = 0; i < n; ++i) {
      const auto state = static_cast<std::size_t>(i);
      Errors& out = errors[k][state];
      out.bounded.add(of_bounded(i));
      out.kalman.add(of_kalman(i));
      out.difference.add(of_bounded(i) - of_kalman(i));
      out.on_line.add(on_line(i));
      if (keep_campaigns) means.back()[k][state] += of_kalman(i) / source_runs;
    }
  }

  /// P does not depend on y.
  void optima(const FirstState<n>& sensor, const jml::Estimate<double, n>& start) {
    jml::Filter kalman{jml::Kalman{}, system, start}, all{jml::Kalman{}, system, start};
    refused += !jml::usable(all.update(sensor, 0.).status);
    for (int k = 0; k < samples; ++k) {
      if (k > 0) refused += !jml::usable(kalman.step(sensor, 0.).status);
      if (k > 0) refused += !jml::usable(all.step(sensor, 0.).status);
      if (k < first) continue;
      for (int i = 0; i < n; ++i) {
        Errors& out = errors[static_cast<std::size_t>(k - first)][static_cast<std::size_t>(i)];
        out.optimum = kalman.P()(i, i);
        out.optimum_all = all.P()(i, i);
      }
    }
  }
};

/// The printed run against ours: its largest distance from the optimum, in its own scatter, and the share of
/// our campaigns of 100 runs that have one as large.
struct Stray {
  double largest = 0, share = 0;
};

template <typename D>
Stray stray(const Campaign<D>& campaign, std::size_t state, const Printed& printed) {
  const auto distance = [&](std::size_t k, double mean) {
    const Errors& e = campaign.errors[k][state];
    return std::abs(mean - e.optimum) / scatter(e.kalman);
  };
  Stray out;
  for (std::size_t k = 1; k < rows; ++k) out.largest = std::max(out.largest, distance(k, printed.actual[k]));
  int farther = 0;
  for (const auto& means : campaign.means) {
    double largest = 0;
    for (std::size_t k = 1; k < rows; ++k) largest = std::max(largest, distance(k, means[k][state]));
    farther += largest >= out.largest;
  }
  out.share = farther / static_cast<double>(campaign.means.size());
  return out;
}

/// The two estimators along x, with the bands in which 95 % of the means of 100 runs lie.
struct Curves {
  std::vector<double> x{}, kalman{}, kalman_low{}, kalman_high{}, bounded{}, bounded_low{}, bounded_high{},
      all{};
  void add(double at, const Errors& e) {
    const auto put = [](const Mean& m, auto& value, auto& low, auto& high) {
      value.push_back(m.value());
      low.push_back(m.value() - 1.96 * scatter(m));
      high.push_back(m.value() + 1.96 * scatter(m));
    };
    x.push_back(at);
    put(e.kalman, kalman, kalman_low, kalman_high);
    put(e.bounded, bounded, bounded_low, bounded_high);
    all.push_back(e.optimum_all);
  }
  [[nodiscard]] std::vector<Series> series(const std::string& which = "") const {
    const char* line = "linespoints pt 7 ps 0.5 lw 1.6";
    return {band("95 % of 100 runs", colour::blue, x, kalman_low, kalman_high),
            band("95 % of 100 runs", colour::red, x, bounded_low, bounded_high),
            {"Kalman filter" + which, colour::blue, x, kalman, line},
            {"bounded noise" + which, colour::red, x, bounded, line}};
  }
  [[nodiscard]] Series with_first_sample() const {
    return {"Kalman filter with the first sample", colour::sky, x, all, "lines lw 1.6 dt (8,5)"};
  }
};

}  // namespace demo::dissertation
