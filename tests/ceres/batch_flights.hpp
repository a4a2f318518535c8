// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Simulated flights for both engines of the whole-interval problem, and the comparison of their answers.
#pragma once

#include <gtest/gtest.h>

#include <jml/interval/ceres.hpp>
#include <jml/interval/criterion.hpp>
#include <jml/campaign/noise.hpp>

namespace batch_flights {

/// One measurement a step; every `outlier`-th is off by ten standard deviations (0: none).
template <typename D, typename S>
struct Flight {
  static constexpr int n = D::states, q = D::disturbances, p = S::measurements;
  using Batch = decltype(jml::Batch{std::declval<D>(), jml::sensors<S>, jml::Estimate<double, n>{}, {1}});
  D dynamics;
  S sensor;
  jml::Estimate<double, n> prior;
  std::vector<jml::Vector<double, p>> y;

  Flight(const D& d, const S& s, const jml::Estimate<double, n>& estimate, int steps, std::uint64_t seed,
         int outlier = 0)
      : dynamics(d), sensor(s), prior(estimate) {
    jml::Noise noise(seed);
    jml::Vector<double, n> x = prior.x + noise.normal_vector(prior.P);
    for (int k = 1; k <= steps; ++k) {
      x = (d.dynamics(x) + d.disturbance_input() * noise.normal_vector<q>(d.disturbance_covariance())).eval();
      y.push_back(s.measurement(x) + noise.normal_vector<p>(s.noise_covariance()));
      if (outlier > 0 && k % outlier == 0) y.back() += 10 * s.noise_covariance().diagonal().cwiseSqrt();
    }
  }
  [[nodiscard]] Batch batch() const {
    Batch out{dynamics, jml::sensors<S>, prior, {static_cast<int>(y.size())}};
    for (const auto& of_step : y) EXPECT_EQ(out.step(sensor, of_step), jml::Status::ok);
    return out;
  }
  /// J of the states in `batch` by eq. (5); NaN where no disturbance of the model leads along them.
  [[nodiscard]] double criterion(const Batch& batch) const {
    jml::Criterion J{dynamics, prior};
    (void)J.start(batch.x(0));
    for (std::size_t k = 0; k < y.size(); ++k) {
      (void)J.advance_to(batch.x(static_cast<int>(k) + 1));
      (void)J.measure(sensor, y[k]);
    }
    return J.value();
  }
};

/// The largest difference of a component over the largest value of that component in the interval.
template <int n, typename First, typename Second>
double difference(int last, const First& first, const Second& second) {
  jml::Vector<double, n> worst = jml::Vector<double, n>::Zero(), largest = worst;
  bool finite = true;
  for (int k = 0; k <= last; ++k) {
    const jml::Vector<double, n> a = first(k), b = second(k);
    worst = worst.cwiseMax((a - b).cwiseAbs());
    largest = largest.cwiseMax(a.cwiseAbs());
    finite = finite && jml::all_finite(a) && jml::all_finite(b);
  }
  double out = 0;
  for (int i = 0; i < n; ++i) out = std::max(out, worst(i) > 0 ? worst(i) / largest(i) : 0.0);
  return finite ? out : std::numeric_limits<double>::quiet_NaN();
}

/// Solves with both from the same start: J to `cost` of itself; x to 1e-6 of the largest value of each
/// component, w to 1e-5 (a difference of neighbouring states), P of three nodes to 1e-5 of its largest entry
/// (how far f and m bend over the error of x). Ceres judges a step by J, which hides errors of x below
/// √epsilon of a standard deviation.
template <typename Batch>
jml::CeresReport expect_agreement(Batch& by_sweep, Batch& by_ceres, const jml::CeresOptions& options = {},
                                  double cost = 1e-9) {
  const auto swept = by_sweep.solve();
  const auto report = jml::solve_with_ceres(by_ceres, options);
  EXPECT_TRUE(jml::usable(swept.status)) << describe(swept.status);
  EXPECT_EQ(report.status, jml::Status::ok) << describe(report.status) << "; " << report.last.message;
  EXPECT_NEAR(report.cost, swept.cost, cost * swept.cost);
  EXPECT_LE(report.defect, 1e-12);
  const int last = by_sweep.steps();
  const double apart = difference<Batch::states>(
      last, [&](int k) { return by_sweep.x(k); }, [&](int k) { return by_ceres.x(k); });
  EXPECT_LE(apart, 1e-6);
  const double disturbed = difference<Batch::disturbances>(
      last - 1, [&](int k) { return by_sweep.w(k); }, [&](int k) { return by_ceres.w(k); });
  EXPECT_LE(disturbed, 1e-5);
  for (const int k : {0, last / 2, last}) {
    const auto P = by_sweep.P(k), other = by_ceres.P(k);
    EXPECT_LE((P - other).cwiseAbs().maxCoeff(), 1e-5 * P.cwiseAbs().maxCoeff());
  }
  return report;
}

/// The same of a flight; and Ceres' answer is a trajectory of the model whose J is what Ceres says.
template <typename D, typename S>
jml::CeresReport expect_agreement(const Flight<D, S>& flight, const jml::Loss& loss = {}) {
  auto by_sweep = flight.batch(), by_ceres = flight.batch();
  by_sweep.options.loss = by_ceres.options.loss = loss;
  const auto report = expect_agreement(by_sweep, by_ceres);
  if (loss.kind == jml::Loss::Kind::none) {
    EXPECT_NEAR(flight.criterion(by_ceres), report.cost, 1e-9 * report.cost);
  }
  return report;
}

}  // namespace batch_flights
