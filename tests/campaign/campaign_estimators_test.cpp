// SPDX-License-Identifier: BSD-3-Clause
// Every kind of estimator of the library in a campaign does what the same estimator does when it is flown by
// hand over the same flight.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/continuous/algebraic.hpp>
#include <jml/bounded/bounded_noise.hpp>
#include <jml/filter/filter.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/campaign/campaign.hpp>

#include "models/continuous.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using State = jml::Vector<double, 2>;

struct BoundedVanDerPol : models::VanDerPol {
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(0.5); }
};
struct BoundedPosition : models::SaturatingPosition {
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(0.02); }
};

struct Flights {
  static constexpr int states = 2, measurements = 1;
  std::string name = "Van der Pol";
  int steps = 100;  // more than a leg
  double dt = 0.05;
  bool measured_at_start = true;
  BoundedPosition sensor{};
  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    State x0;
    for (int i = 0; i < 2; ++i) x0(i) = noise.uniform(-1, 1);
    jml::simulate(BoundedVanDerPol{}, sensor, x0, jml::UniformNoise{}, jml::UniformNoise{}, noise, flight);
  }
};

const jml::Estimate prior{State(State::Zero()), jml::Matrix<double, 2, 2>::Identity()};

const auto ekf = [](const auto&) { return jml::Filter{jml::Ekf{}, BoundedVanDerPol{}, prior}; };
const auto lag = [](const auto&) {
  return jml::Filter{jml::FixedLag<5>{}, BoundedVanDerPol{}, jml::sensors<BoundedPosition>, prior};
};
const auto bounded = [](const auto&) {
  return jml::Filter{jml::Guaranteed{}, BoundedVanDerPol{},
                           jml::Box<double, 2>{State(-1, -1), State(1, 1)}};
};
const auto algebraic = [](const auto&) {
  return jml::Filter{jml::Algebraic{jml::Sddre{}}, models::Oscillator{.c = 0.1, .k = 1}, State(State::Zero())};
};

jml::Campaign campaign{
    Flights{}, jml::Estimator{"EKF", ekf, jml::OneStep{}},
    jml::Estimator{"lag 5", lag, [](const auto&, const auto& report) { return report.cost; }},
    jml::Estimator{"bounded", bounded}, jml::Estimator{"algebraic", algebraic}};

/// The estimates of the filter flown by hand, with what `look` finds after each step.
template <typename Make, typename Look>
void by_hand(const jml::Flight<2, 1>& flight, const Make& make, const Look& look) {
  auto filter = make(flight);
  if constexpr (requires { filter.update(BoundedPosition{}, flight.y[0]); }) {
    const auto first = filter.update(BoundedPosition{}, flight.y[0]);
    if constexpr (requires { filter.belief().warm; })
      EXPECT_EQ(first.status, jml::Status::invalid_time_step) << "no gain before the first step";
    else
      EXPECT_TRUE(jml::usable(first.status));
  }
  for (std::size_t k = 1; k <= 100; ++k) {
    const auto prior_to_it = filter;
    const auto report = filter.step(BoundedPosition{}, flight.y[k], 0.05);
    ASSERT_TRUE(jml::usable(report.status)) << k;
    look(k, prior_to_it, filter, report);
  }
}

TEST(CampaignEstimators, EachIsTheFilterFlownByHand) {
  campaign.options = {.runs = 3, .threads = 1};
  const auto replay = campaign.replay(2);
  ASSERT_TRUE(replay.ok()) << replay.error;
  for (const auto& track : replay.tracks) {
    EXPECT_FALSE(track.fault.has_value()) << track.name;
    ASSERT_EQ(track.rows.size(), 101U) << track.name;
  }
  const auto& rows = replay.tracks;
  by_hand(replay.flight, ekf, [&](std::size_t k, const auto& before, const auto& filter, const auto& report) {
    const auto& row = rows[0].rows[k];
    EXPECT_EQ(row.x, filter.x()) << k;
    EXPECT_EQ(row.nis, report.nis());
    const State error = filter.x() - replay.flight.truth[k];
    EXPECT_NEAR(row.nees, error.dot(filter.P().inverse() * error), 1e-9 * row.nees);
    EXPECT_EQ(row.scalar_error, error.norm());
    EXPECT_EQ(row.cost, jml::one_step_cost(filter.method(), filter.dynamics(), BoundedPosition{},
                                           before.estimate(), replay.flight.y[k],
                                           jml::StepContext<double>{0.05 * (double(k) - 1), 0.05}, report)
                            .value);
  });
  by_hand(replay.flight, lag, [&](std::size_t k, const auto&, const auto& filter, const auto& report) {
    const auto& row = rows[1].rows[k];
    EXPECT_EQ(row.x, filter.x()) << k;
    EXPECT_EQ(row.cost, report.cost);
    const State error = filter.x() - replay.flight.truth[k];
    EXPECT_NEAR(row.nees, error.dot(filter.P().inverse() * error), 1e-9 * row.nees);
    EXPECT_TRUE(std::isnan(row.nis)) << "no gate, no NIS";
  });
  by_hand(replay.flight, bounded, [&](std::size_t k, const auto&, const auto& filter, const auto&) {
    EXPECT_EQ(rows[2].rows[k].x, filter.x()) << k;
    EXPECT_EQ(rows[2].rows[k].box.lower, filter.box().lower);
    EXPECT_EQ(rows[2].rows[k].box.upper, filter.box().upper);
  });
  by_hand(replay.flight, algebraic, [&](std::size_t k, const auto&, const auto& filter, const auto&) {
    EXPECT_EQ(rows[3].rows[k].x, filter.x()) << k;
  });
}

TEST(CampaignEstimators, TheGuaranteedBoxHoldsEveryTruth) {
  campaign.options = {.runs = 200, .threads = 2};
  const auto result = campaign.run();
  ASSERT_TRUE(result.ok()) << result.message();
  const auto bounded_figures = result.estimator("bounded");
  EXPECT_EQ(bounded_figures.kept(), 200);
  for (int k = 0; k <= 100; ++k) {
    EXPECT_EQ(bounded_figures.at(k).contained(), 1) << k;
    EXPECT_GT(bounded_figures.at(k).width(0), 0);
  }
  EXPECT_TRUE(std::isnan(result.estimator("EKF").at(1).contained())) << "it has no box";
  EXPECT_TRUE(std::isnan(bounded_figures.nees().value)) << "it has no P";
  EXPECT_GT(result.share_inside(), 0.5);
  EXPECT_LE(result.share_inside(), 1);
}

/// x⁺ = x + dt u + w, y = x + t: a filter that is not given control and time is wrong by far more than its
/// noise.
struct Cart {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + at.dt * at.control(0));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1e-6); }
};
struct Drifting {
  static constexpr int measurements = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + at.time);
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1e-6); }
};
struct Rides {
  static constexpr int states = 1, measurements = 1, controls = 1;
  std::string name = "cart";
  int steps = 70;
  double dt = 0.5;
  Drifting sensor{};
  double lost = 0.1;
  void fly(jml::CounterNoise& noise, jml::Flight<1, 1, 1>& flight) const {
    for (auto& u : flight.control) u(0) = noise.uniform(-100, 100);
    flight.guess(0) = noise.normal();
    jml::simulate(Cart{}, sensor, flight.guess, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
};
TEST(CampaignEstimators, ControlTimeAndGuessReachTheFilter) {
  jml::Campaign rides{Rides{},
                      jml::Estimator{"EKF", [](const auto& flight) {
                                       return jml::Filter{
                                           jml::Ekf{}, Cart{},
                                           jml::Estimate{flight.guess, jml::Matrix<double, 1, 1>::Zero()}};
                                     }}};
  rides.options = {.runs = 50, .threads = 1};
  const auto result = rides.run();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.estimator(0).kept(), 50);
  EXPECT_LT(result.estimator(0).run_rmse().value, 1.1e-3);
}

}  // namespace
