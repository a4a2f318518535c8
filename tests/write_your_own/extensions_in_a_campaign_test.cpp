// SPDX-License-Identifier: BSD-3-Clause
// The methods and rules of examples/write_your_own in campaigns and under the consistency tests, of which
// they know nothing.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/analysis/consistency.hpp>
#include <jml/campaign/campaign.hpp>

#include "models/linear.hpp"
#include "models/van_der_pol.hpp"
#include "write_your_own/consider_ekf.hpp"
#include "write_your_own/cubature.hpp"
#include "write_your_own/midpoint_slot.hpp"

namespace {

template <int n>
using V = jml::Vector<double, n>;
template <int n>
using M = jml::Matrix<double, n, n>;

struct VanDerPolFlights {
  static constexpr int states = 2, measurements = 1;
  std::string name = "Van der Pol";
  int steps = 100;
  double dt = 0.05;
  bool measured_at_start = true;
  models::SaturatingPosition sensor{};
  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    V<2> x0;
    for (int i = 0; i < 2; ++i) x0(i) = noise.uniform(-1, 1);
    jml::simulate(models::VanDerPol{}, sensor, x0, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
};

const jml::Estimate prior{V<2>(V<2>::Zero()), M<2>(M<2>::Identity())};
template <typename Rule>
auto maker(const Rule& rule) {
  return [rule](const auto&) { return jml::Filter{rule, models::VanDerPol{}, prior}; };
}
const auto cubature = maker(own::Cubature{});
const auto consider = maker(own::ConsiderEkf<1>{});
const auto sddre = maker(own::MidpointSddre{});
const auto joint = maker(own::MidpointJml{});
const auto iterated = maker(jml::Iterated<own::MidpointJml<>>{});

jml::Campaign campaign{
    VanDerPolFlights{},
    jml::Estimator{"cubature", cubature,
                   [](const auto&, const auto& report) { return -report.log_likelihood(); }},
    jml::Estimator{"consider", consider},
    jml::Estimator{"midpoint SDDRE", sddre},
    jml::Estimator{"midpoint JML", joint},
    jml::Estimator{"midpoint, iterated", iterated}};

/// The rows of the campaign are what the filter finds that is flown by hand.
template <typename Make, typename Track>
void expect_flown_by_hand(const Make& make, const jml::Flight<2, 1>& flight, const Track& track) {
  SCOPED_TRACE(track.name);
  EXPECT_FALSE(track.fault.has_value());
  ASSERT_EQ(track.rows.size(), 101U);
  auto filter = make(flight);
  EXPECT_TRUE(jml::usable(filter.update(models::SaturatingPosition{}, flight.y[0]).status));
  for (std::size_t k = 1; k <= 100; ++k) {
    const auto report = filter.step(models::SaturatingPosition{}, flight.y[k], 0.05);
    ASSERT_TRUE(jml::usable(report.status)) << k;
    const auto& row = track.rows[k];
    EXPECT_EQ(row.x, filter.x()) << k;
    EXPECT_EQ(row.nis, report.nis()) << k;
    if (!std::isfinite(row.nees)) continue;  // where sym(P) is indefinite, as P of the JML row may be
    const V<2> error = filter.x() - flight.truth[k];
    const M<2> P = (filter.P() + filter.P().transpose()) / 2;
    EXPECT_NEAR(row.nees, error.dot(P.inverse() * error), 1e-9 * row.nees) << k;
  }
}

TEST(ExtensionsInACampaign, EachIsTheFilterFlownByHand) {
  campaign.options = {.runs = 3, .threads = 1};
  const auto replay = campaign.replay(2);
  ASSERT_TRUE(replay.ok()) << replay.error;
  expect_flown_by_hand(cubature, replay.flight, replay.tracks[0]);
  expect_flown_by_hand(consider, replay.flight, replay.tracks[1]);
  expect_flown_by_hand(sddre, replay.flight, replay.tracks[2]);
  expect_flown_by_hand(joint, replay.flight, replay.tracks[3]);
  expect_flown_by_hand(iterated, replay.flight, replay.tracks[4]);
  auto filter = cubature(replay.flight);
  EXPECT_TRUE(jml::usable(filter.update(models::SaturatingPosition{}, replay.flight.y[0]).status));
  const auto report = filter.step(models::SaturatingPosition{}, replay.flight.y[1], 0.05);
  EXPECT_EQ(replay.tracks[0].rows[1].cost, -report.log_likelihood()) << "a cost of one's own";
}

TEST(ExtensionsInACampaign, AnyNumberOfThreadsFindsTheSame) {
  campaign.options = {.runs = 200, .threads = 1};
  const auto one = campaign.run();
  campaign.options.threads = 2;
  const auto two = campaign.run();
  ASSERT_TRUE(one.ok() && two.ok()) << one.message() << two.message();
  for (int j = 0; j < 5; ++j) {
    EXPECT_EQ(one.estimator(j).kept(), 200) << one.estimator(j).name();
    EXPECT_EQ(one.estimator(j).refused(), 0) << one.estimator(j).name();
    for (const int k : {0, 1, 50, 100}) {
      EXPECT_EQ(one.estimator(j).at(k).rmse().value, two.estimator(j).at(k).rmse().value);
      EXPECT_EQ(one.estimator(j).at(k).nis().value, two.estimator(j).at(k).nis().value);
    }
    std::printf("  %-20s RMSE %.4f +- %.4f\n", one.estimator(j).name().c_str(),
                one.estimator(j).run_rmse().value, one.estimator(j).run_rmse().standard_error);
  }
}

/// Position and velocity on a line, and a constant bias of the position that is measured, drawn for each
/// flight.
struct Cart {
  static constexpr int states = 3, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x) const {
    return {x(0) + 0.1 * x(1), x(1), x(2)};
  }
  V<3> disturbance_input() const { return {0.005, 0.1, 0}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.5); }
};
struct BiasedPosition {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 3>& x) const {
    return jml::Vector<T, 1>(x(0) + x(2));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.04); }
};
const V<3> variances(1, 1, 0.25);
struct Rides {
  static constexpr int states = 3, measurements = 1;
  std::string name = "biased position";
  int steps = 100;
  double dt = 0.1;
  BiasedPosition sensor{};
  void fly(jml::CounterNoise& noise, jml::Flight<3, 1>& flight) const {
    V<3> x0;
    for (int i = 0; i < 3; ++i) x0(i) = std::sqrt(variances(i)) * noise.normal();
    jml::simulate(Cart{}, sensor, x0, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
};
template <typename Rule>
auto of_bias(const Rule& rule, double share) {
  M<3> P = variances.asDiagonal();
  P(2, 2) *= share;
  return [rule, P](const auto&) { return jml::Filter{rule, Cart{}, jml::Estimate{V<3>(0, 0, 0), P}}; };
}

// The gain of a consider filter is not the best one, but its P is the covariance of its errors: NEES is χ² of
// 3 degrees at each sample. With a hundredth of the bias's variance it is not: the test can fail. The
// cubature filter is the Kalman filter here, which estimates the bias: better, and as honest.
TEST(ExtensionsInACampaign, NeesOfACovarianceThatIsRight) {
  constexpr int runs = 2000;
  jml::Campaign rides{Rides{}, jml::Estimator{"consider", of_bias(own::ConsiderEkf<1>{}, 1)},
                      jml::Estimator{"bias too small", of_bias(own::ConsiderEkf<1>{}, 0.01)},
                      jml::Estimator{"cubature", of_bias(own::Cubature{}, 1)},
                      jml::Estimator{"Kalman", of_bias(jml::Kalman{}, 1)}};
  rides.options = {.runs = runs, .threads = 2};
  const auto result = rides.run();
  ASSERT_TRUE(result.ok()) << result.message();
  const auto interval = jml::chi_square_average_interval(3, runs, 0.9999);
  const auto innovation = jml::chi_square_average_interval(1, runs, 0.9999);
  for (const int k : {1, 10, 30, 100}) {
    for (const char* name : {"consider", "cubature"}) {
      const auto figures = result.estimator(name).at(k);
      EXPECT_TRUE(interval.contains(figures.nees().value))
          << name << ", " << k << ": " << figures.nees().value;
      EXPECT_TRUE(innovation.contains(figures.nis().value))
          << name << ", " << k << ": " << figures.nis().value;
    }
    EXPECT_GT(result.estimator("bias too small").at(k).nees().value, 2 * interval.high) << k;
    EXPECT_NEAR(result.estimator("cubature").at(k).nees().value,
                result.estimator("Kalman").at(k).nees().value, 1e-9);
    EXPECT_LE(result.estimator("cubature").at(k).mse(0).value,
              result.estimator("consider").at(k).mse(0).value)
        << k;
  }
}

// Over one long flight NIS is independent from sample to sample: the report of any method goes into the test.
TEST(ExtensionsInACampaign, NisOfReports) {
  for (const double share : {1.0, 0.5}) {
    jml::Noise noise(1);
    const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
    const auto sensor = models::random_linear_sensor<3, 2>(noise);
    auto believed = sensor;
    believed.R *= share;
    const M<3> P = M<3>::Identity();
    V<3> truth = noise.normal_vector<3>();
    jml::Filter cubature_filter{own::Cubature{}, dynamics, jml::Estimate{V<3>(0, 0, 0), P}};
    jml::Filter midpoint_filter{own::MidpointSddre{}, dynamics, jml::Estimate{V<3>(0, 0, 0), P}};
    jml::Consistency of_cubature, of_midpoint;
    for (int k = 0; k < 2000; ++k) {
      const V<2> w = noise.normal_vector<2>(dynamics.Q);
      truth = dynamics.F * truth + dynamics.G * w;
      const V<2> y = sensor.M * truth + noise.normal_vector<2>(sensor.R);
      of_cubature.add(cubature_filter.step(believed, y));
      of_midpoint.add(midpoint_filter.step(believed, y));
    }
    const auto wanted = share == 1 ? jml::CovarianceVerdict::consistent : jml::CovarianceVerdict::optimistic;
    EXPECT_EQ(of_cubature.samples(), 2000);
    EXPECT_EQ(of_cubature.verdict(), wanted) << of_cubature.average();
    EXPECT_EQ(of_midpoint.verdict(), wanted) << of_midpoint.average();
    EXPECT_NEAR(of_cubature.average(), of_midpoint.average(), 1e-9);
  }
}

}  // namespace
