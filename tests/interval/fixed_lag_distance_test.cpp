// SPDX-License-Identifier: BSD-3-Clause
// How far a fixed-lag filter is from the exact estimator. At the ends of its range it is not far at all: one
// step has the root of the iterated rule, and a window as long as the flight has the batch answer. Between
// them the distance falls with the time that the window spans.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <vector>

#include "filter/random_steps.hpp"

namespace {

using namespace jml::operators;

using jml::usable;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

/// To convergence.
constexpr jml::LagOptions converged{.sweeps = 100, .tolerance = 0};

/// A flight of `steps` steps, and at each of them the newest state of the optimum over the interval so far.
template <typename D, typename S>
struct Flight {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> start;
  std::vector<jml::Vector<double, p>> y;
  std::vector<jml::Vector<double, n>> optimum;

  Flight(const D& d, const S& s, const jml::Estimate<double, n>& from, int steps, std::uint64_t seed)
      : dynamics(d), sensor(s), start(from) {
    jml::Noise noise(seed);
    jml::Vector<double, n> x = start.x + noise.normal_vector<n>(start.P);
    jml::Batch batch{dynamics, jml::sensors<S>, start, {steps}};
    batch.start = jml::Start::given;  // the last optimum, and the prediction after it
    for (int k = 0; k < steps; ++k) {
      x = dynamics.dynamics(x) +
          dynamics.disturbance_input() * noise.normal_vector(dynamics.disturbance_covariance());
      y.push_back(sensor.measurement(x) + noise.normal_vector(sensor.noise_covariance()));
      EXPECT_EQ(batch.step(sensor, y.back()), jml::Status::ok);
      batch.guess(dynamics.dynamics(batch.x(k)));
      EXPECT_TRUE(usable(batch.solve().status));
      optimum.push_back(batch.x(k + 1));
    }
    // From elsewhere the same minimum is found.
    batch.start = jml::Start::filter;
    EXPECT_TRUE(usable(batch.solve().status));
    EXPECT_LT((batch.x(steps) - optimum.back()).norm(), 1e-8 * (1 + optimum.back().norm()));
  }

  /// Root mean square over time of |x̂ - optimum|.
  template <typename Filter>
  [[nodiscard]] double distance(Filter filter) const {
    double sum = 0;
    for (std::size_t k = 0; k < y.size(); ++k) {
      EXPECT_TRUE(usable(filter.step(sensor, y[k]).status)) << k;
      sum += (filter.x() - optimum[k]).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(y.size()));
  }
};

/// Flights of one kind; every distance is the median over them.
template <typename D, typename S>
struct Campaign {
  std::vector<Flight<D, S>> flights;
  double ekf = 0;

  Campaign(const char* name, const D& dynamics, const S& sensor,
           const jml::Estimate<double, jml::states_of<D>>& start, int steps, int seeds) {
    for (int seed = 1; seed <= seeds; ++seed)
      flights.emplace_back(dynamics, sensor, start, steps, static_cast<std::uint64_t>(seed));
    ekf =
        over_flights([](const auto& f) { return f.distance(jml::Filter{jml::Ekf{}, f.dynamics, f.start}); });
    std::printf("%s, %d flights: EKF %.2e\n", name, seeds, ekf);
  }
  template <int L>
  [[nodiscard]] double lag(const jml::LagOptions& options = {}) const {
    const double out = over_flights([&](const auto& f) {
      jml::Filter filter{jml::FixedLag<L>{}, f.dynamics, jml::sensors<S>, f.start};
      filter.method().options = options;
      return f.distance(filter);
    });
    std::printf("  L = %3d, %3d sweeps: %.2e, 1/%.4g of the EKF's\n", L, options.sweeps, out, ekf / out);
    return out;
  }

 private:
  template <typename Distance>
  [[nodiscard]] double over_flights(const Distance& distance) const {
    std::vector<double> all;
    for (const auto& flight : flights) all.push_back(distance(flight));
    return median(all);
  }
};

/// Rusnak 2015's example over 6 s. R = R_c/dt, R_c = 1e-3 1/Hz; Q_c = 1 (1/s²)²/Hz.
auto van_der_pol(const char* name, double dt, int seeds) {
  const jml::Estimate<double, 2> start{{1, 1}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  return Campaign(name, models::VanDerPol{.dt = dt}, models::SaturatingPosition{.r = 1e-3 / dt}, start,
                  static_cast<int>(std::lround(6 / dt)), seeds);
}

TEST(FixedLagDistance, VanDerPol) {
  const auto campaign = van_der_pol("Van der Pol, 50 ms", 0.05, 20);
  const double one = campaign.lag<1>(), twenty = campaign.lag<20>(), forty = campaign.lag<40>(),
               twenty_converged = campaign.lag<20>(converged), forty_converged = campaign.lag<40>(converged);
  EXPECT_GT(one, campaign.ekf / 2);  // one step back gains nothing
  EXPECT_LT(twenty, campaign.ekf / 20);
  EXPECT_LT(forty, campaign.ekf / 30);
  EXPECT_LE(twenty_converged, twenty);
  EXPECT_LT(forty_converged, campaign.ekf / 300);
}

// At a fifth of dt the same number of steps is a fifth of the time: 20 steps, 0.2 s, are worth little, 100
// steps are worth what 20 are above.
TEST(FixedLagDistance, LagTimeCounts) {
  const auto campaign = van_der_pol("Van der Pol, 10 ms", 0.01, 6);
  const double twenty = campaign.lag<20>(), hundred = campaign.lag<100>();
  EXPECT_GT(twenty, campaign.ekf / 5);
  EXPECT_LT(twenty, campaign.ekf / 1.3);
  EXPECT_LT(hundred, campaign.ekf / 25);
}

// A disturbance and a prior large enough that the EKF is off by a twentieth of its error.
TEST(FixedLagDistance, Pendulum) {
  const jml::Estimate<double, 2> start{{1, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  const Campaign campaign("pendulum", models::Pendulum{.variance = 20}, models::SineSensor{}, start, 100, 20);
  EXPECT_GT(campaign.ekf, 0.01);  // rad and rad/s: not rounding
  const double one = campaign.lag<1>(), twenty = campaign.lag<20>(),
               twenty_converged = campaign.lag<20>(converged);
  EXPECT_LT(one, campaign.ekf * 2);
  EXPECT_LT(twenty, std::min(one, campaign.ekf) / 20);
  EXPECT_LT(twenty_converged, campaign.ekf / 200);
}

TEST(FixedLagDistance, Radar) {
  jml::Estimate<double, 6> start;
  start.x << 20, 10, 5, -0.4, 0.3, 0.2;
  start.P = jml::Vector<double, 6>(1, 1, 1, 0.04, 0.04, 0.04).asDiagonal();
  const Campaign campaign("radar",
                          models::BallisticTarget{.dt = 1, .drag = 0.2, .acceleration_variance = 1e-3},
                          models::Radar{.range_sd = 0.3, .angle_sd = 0.02}, start, 40, 20);
  EXPECT_GT(campaign.ekf, 0.01);  // km and km/s
  const double one = campaign.lag<1>(), twenty = campaign.lag<20>();
  EXPECT_LT(one, campaign.ekf);
  EXPECT_LT(twenty, one / 200);
}

// One step from a fresh filter: both of its states are the root of the implicit rule (9). Where a step has
// several roots the two may end at different ones; roots they are by the oracle of random_steps.hpp.
template <typename Task>
void one_step_has_the_root(const char* name, std::uint64_t seed, int several_roots) {
  jml::Noise noise(seed);
  int other_root = 0;
  double worst = 0, worst_residual = 0;
  for (int k = 0; k < 1000; ++k) {
    Task task;
    random_steps::draw(task, noise, k % 2 == 1, true);
    jml::Filter filter{jml::FixedLag<1>{}, task.dynamics, jml::sensors<decltype(task.sensor)>, task.prior};
    auto hasty = filter;
    filter.method().options = converged;
    const auto report = filter.step(task.sensor, task.y);
    // Newton's method: some 4 sweeps, and never anything near 100.
    ASSERT_TRUE(report.status == jml::Status::ok || report.status == jml::Status::accepted_at_rounding)
        << name << " " << k << ": " << jml::describe(report.status) << ", J " << report.cost;
    const auto root = jml::step(jml::IteratedJml{}, task.dynamics, task.sensor, task.prior, task.y);
    ASSERT_TRUE(usable(root.report.status)) << name << " " << k;
    const double off = (filter.x(0) - root.estimate.x).norm() + (filter.x(1) - root.report.smoothed).norm();
    const double relative = off / (1 + filter.x().norm());
    const bool other = relative > 1e-3 && k % 2 == 1;
    other_root += other;
    if (!other) worst = std::max(worst, relative);
    worst_residual = std::max(worst_residual, random_steps::judge(task, filter.x(1), filter.x(0)).residual);
    // Two sweeps may not lower J at all in the strongest of these steps; that is no refusal.
    EXPECT_TRUE(usable(hasty.step(task.sensor, task.y).status)) << name << " " << k;
  }
  std::printf("%-12s distance of the roots %.1e, residual of the two lines %.1e, %d at another root\n", name,
              worst, worst_residual, other_root);
  EXPECT_LE(other_root, several_roots);
  EXPECT_LT(worst, 1e-8);
  EXPECT_LT(worst_residual, 1e-6);  // weighted by R⁻¹: 100 times the distance in the strongest steps
}
TEST(FixedLagEnds, OneStepIsTheIteratedRule) {
  one_step_has_the_root<random_steps::VanDerPol>("Van der Pol", 1, 0);
  one_step_has_the_root<random_steps::Pendulum>("pendulum", 6, 3);
  one_step_has_the_root<random_steps::Radar>("radar", 3, 0);
}

// … with a robust loss too, which every tenth measurement needs: it is off by many standard deviations.
template <int L, typename D, typename S, int n>
void whole_interval_is_the_batch(const D& dynamics, const S& sensor, const jml::Estimate<double, n>& start,
                                 int steps, std::uint64_t seed) {
  const Flight<D, S> flight(dynamics, sensor, start, steps, seed);
  for (const jml::Loss loss : {jml::Loss{}, jml::Loss::huber(1.5)}) {
    jml::Filter filter{jml::FixedLag<L>{}, dynamics, jml::sensors<S>, start};
    filter.method().options = converged;
    filter.method().options.loss = loss;
    jml::Batch batch{dynamics, jml::sensors<S>, start, {steps}};
    batch.options.loss = loss;
    for (std::size_t k = 0; k < flight.y.size(); ++k) {
      auto y = flight.y[k];
      if (loss.kind == jml::Loss::Kind::huber && k % 10 == 7) y(0) += 1;
      ASSERT_TRUE(usable(filter.step(sensor, y).status)) << k;
      ASSERT_EQ(batch.step(sensor, y), jml::Status::ok);
    }
    ASSERT_TRUE(usable(batch.solve().status));
    ASSERT_EQ(filter.depth(), steps);
    batch.covariances([&](int k, const auto& P) {
      const int age = steps - k;
      EXPECT_LT((filter.x(age) - batch.x(k)).norm(), 1e-8) << k;
      EXPECT_LT((filter.P(age) - P).norm(), 1e-8) << k;
    });
  }
}
TEST(FixedLagEnds, WholeIntervalIsTheBatch) {
  const jml::Estimate<double, 2> start{{1, 1}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  const jml::Estimate<double, 2> known{{2, 0}, jml::Matrix<double, 2, 2>::Zero()};
  const models::SaturatingPosition sensor;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    whole_interval_is_the_batch<40>(models::VanDerPol{}, sensor, start, 40, seed);
    whole_interval_is_the_batch<40>(models::VanDerPol{.c = 1}, sensor, known, 30, seed);
    whole_interval_is_the_batch<20>(models::Pendulum{.variance = 20}, models::SineSensor{}, start, 20, seed);
  }
}

}  // namespace
