// SPDX-License-Identifier: BSD-3-Clause
// The navigation parts to copy (examples/navigation): flights are what their model says, and the filter that
// the library derives from the models is the one that is written by hand, Jacobians and reset included.
#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>
#include <navigation/trajectory.hpp>

#include "figure.hpp"
#include "models/strapdown_by_hand.hpp"

namespace {

using namespace navigation;
using models::StrapdownByHand;
namespace by_hand = models::by_hand;
using Error = jml::Vector<double, degrees>;
using Covariance = jml::Matrix<double, degrees, degrees>;
using Noises = jml::Vector<double, 12>;

Flight some_flight(jml::Noise& random, double dt, int steps, const Strapdown& unit = {}) {
  const Path path(Liveliness{}, random);
  const jml::Vector<double, 6> sizes{0.01, 0.01, 0.01, 0.1, 0.1, 0.1};
  const jml::Vector<double, 6> biases = sizes.cwiseProduct(random.normal_vector<6>());
  return fly(unit, path, biases, dt, steps, random);
}
double off(const State<double>& a, const State<double>& b) {
  return Space::minus(a, b).cwiseAbs().maxCoeff();
}

TEST(Navigation, FlightsObeyTheirModel) {
  jml::Noise random(1);
  const Strapdown unit;
  for (const double dt : {0.01, 0.1}) {
    for (int i = 0; i < 10; ++i) {
      const Flight flight = some_flight(random, dt, 1000);
      for (std::size_t k = 0; k < flight.motion.size(); ++k) {
        jml::StepContext<double, 6> at{static_cast<double>(k) * dt, dt, flight.inertial[k]};
        ASSERT_LT(off(unit.dynamics(flight.truth[k], flight.w[k], at), flight.truth[k + 1]), 1e-11);
        // A perfect unit: no noise, no bias.
        at.control = flight.motion[k];
        State<double> here = flight.truth[k], there = flight.truth[k + 1];
        here.tail<6>().setZero();
        there.tail<6>().setZero();
        ASSERT_LT(off(unit.dynamics(here, Noises(Noises::Zero()), at), there), 1e-11);
      }
    }
  }
}

// Rate and force are those of the functions of time: a step of a tenth is four times nearer to them, twice.
TEST(Navigation, SamplesAreThoseOfAMotion) {
  const auto farthest = [](double dt) {
    jml::Noise random(2);
    const Path path(Liveliness{}, random);
    const Flight flight = fly(Strapdown{}, path, jml::Vector<double, 6>::Zero(), dt, int(10 / dt), random);
    double most = 0;
    for (int k = 0; k < flight.steps(); ++k) {
      const double t = (k + 0.5) * dt, h = 1e-4;
      const jml::Vector<double, 4> q = path.attitude(t);
      const jml::Vector<double, 3> rate = jml::log_quaternion(jml::quaternion_product(
                                              jml::conjugate(path.attitude(t - h)), path.attitude(t + h))) /
                                          (2 * h);
      jml::Vector<double, 3> force = (path.velocity(t + h) - path.velocity(t - h)) / (2 * h);
      force(2) += 9.81;
      const auto& motion = flight.motion[static_cast<std::size_t>(k)];
      most = std::max(
          {most, (motion.head<3>() - rate).norm(), (motion.tail<3>() - jml::rotate_back(q, force)).norm()});
    }
    return most;
  };
  const double coarse = farthest(0.1), fine = farthest(0.05);
  EXPECT_LT(coarse, 0.1);
  EXPECT_NEAR(coarse / fine, 4, 0.5);
}

// The noise of the samples has the covariance of the grade, and the measurements those of their sensors.
TEST(Navigation, NoiseIsThatOfTheModels) {
  jml::Noise random(3);
  const Strapdown unit;
  const Flight flight = some_flight(random, 0.02, 20000);
  const auto Q = unit.disturbance_covariance(flight.truth[0], jml::StepContext<double, 6>{0, 0.02});
  jml::Vector<double, 12> sum = jml::Vector<double, 12>::Zero();
  for (std::size_t k = 0; k < flight.w.size(); ++k) {
    sum += flight.w[k].cwiseAbs2();
    const auto& x = flight.truth[k];
    ASSERT_LT((flight.inertial[k] - flight.motion[k] - x.tail<6>() - flight.w[k].head<6>()).norm(), 1e-13);
  }
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(sum(i) / 20000 / Q(i, i), 1, 0.05) << i;

  const GnssFix gnss({0.5, 0.2, -1});
  jml::Vector<double, 6> squares = jml::Vector<double, 6>::Zero();
  for (int k = 1; k <= 20000; ++k) {
    const auto& x = flight.truth[static_cast<std::size_t>(k)];
    const auto R = by_hand::rotation(Space::minus(x, State<double>(State<double>::Unit(0))).head<3>());
    const by_hand::Vector3 rate = flight.motion[static_cast<std::size_t>(k - 1)].head<3>();
    jml::Vector<double, 6> error = measure(gnss, flight, k, random);
    error.head<3>() -= x.segment<3>(position) + R * gnss.place.arm;
    error.tail<3>() -= x.segment<3>(velocity) + R * rate.cross(gnss.speed.arm);
    squares += error.cwiseAbs2();
  }
  const jml::Vector<double, 6> R = gnss.noise_covariance().diagonal();
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(squares(i) / 20000 / R(i), 1, 0.05) << i;
}

/// What the derived and the hand-written filter differ by: x in standard deviations, P in those of its rows.
double difference(const auto& filter, const StrapdownByHand& hand) {
  const Error sigma = hand.P.diagonal().cwiseSqrt();
  const Error x = Space::minus(filter.x(), hand.x).cwiseQuotient(sigma);
  const Covariance P = filter.P() - hand.P;
  double most = x.cwiseAbs().maxCoeff();
  for (int j = 0; j < degrees; ++j) {
    for (int i = 0; i < degrees; ++i) most = std::max(most, std::abs(P(i, j)) / (sigma(i) * sigma(j)));
  }
  return most;
}

/// The farthest that they come apart in five flights. Predictions, and corrections by each of the sensors;
/// those by the barometer in one step with the prediction.
template <typename Rule>
double farthest(const Rule& rule, double dt, double heading, bool resets = true) {
  jml::Noise random(4);
  const Strapdown unit;
  const GnssPosition place{.arm = {0.5, 0.2, -1}};
  const GnssFix fix({-0.3, 1, 0.4});
  const Barometer baro;
  const Magnetometer compass;
  const StarVector star{.direction = {0.6, 0, 0.8}, .sigma = 1e-3};
  const ZeroVelocity still{.sigma = 30};
  double most = 0;
  for (int run = 0; run < 5; ++run) {
    const Flight flight = some_flight(random, dt, 1500);
    Error sigma;
    sigma << 0.05, 0.05, heading, 5, 5, 5, 0.5, 0.5, 0.5, 0.01, 0.01, 0.01, 0.1, 0.1, 0.1;
    const Error e = sigma.cwiseProduct(random.normal_vector<degrees>());
    const State<double> x0 = Space::plus(flight.truth[0], Error(-e));
    const Covariance P0 = sigma.cwiseAbs2().asDiagonal();
    jml::Filter filter{rule, unit, jml::Estimate{x0, P0}};
    StrapdownByHand hand{unit, x0, P0, resets};
    for (int k = 1; k <= flight.steps(); ++k) {
      const auto& sample = flight.inertial[static_cast<std::size_t>(k - 1)];
      const jml::StepContext<double, 6> at{k * dt, dt, sample};
      const auto correct = [&](const auto& sensor, const auto& y, const auto& m_x) {
        const std::remove_cvref_t<decltype(y)> m = jml::measurement(sensor, hand.x, at);
        hand.correct(y, m, m_x, sensor.noise_covariance());
      };
      const auto correct_both = [&](const auto& sensor, const auto& m_x) {
        const auto y = measure(sensor, flight, k, random);
        correct(sensor, y, m_x);
        EXPECT_TRUE(jml::usable(filter.update(sensor, y)));
        most = std::max(most, difference(filter, hand));
      };
      hand.predict(sample, dt);
      if (k % 10 == 0) {
        const auto y = measure(baro, flight, k, random);
        EXPECT_TRUE(jml::usable(filter.step(baro, y, dt, sample)));
        correct(baro, y, by_hand::height_slope());
      } else {
        EXPECT_EQ(filter.predict(dt, sample), jml::Status::ok);
      }
      most = std::max(most, difference(filter, hand));
      if (k % 50 == 0) correct_both(place, by_hand::position_slope(hand.R(), place.arm));
      if (k % 70 == 0) {
        jml::Matrix<double, 6, 15> m_x;
        const by_hand::Vector3 rate = hand.rate - hand.x.segment<3>(gyro_bias);
        m_x << by_hand::position_slope(hand.R(), fix.place.arm),
            by_hand::velocity_slope(hand.R(), fix.speed.arm, rate);
        correct_both(fix, m_x);
      }
      if (k % 110 == 0) correct_both(compass, by_hand::vector_slope(hand.R(), compass.field));
      if (k % 130 == 0) correct_both(star, by_hand::vector_slope(hand.R(), star.direction));
      if (k % 170 == 0) correct_both(still, by_hand::velocity_slope(hand.R(), {0, 0, 0}, {0, 0, 0}));
    }
  }
  return most;
}

TEST(Navigation, DerivedFilterIsTheHandWrittenOne) {
  const double small = farthest(jml::Ekf{}, 0.01, 0.1),
               large = farthest(jml::Ekf{}, 0.1, 1);  // large steps and corrections
  EXPECT_LT(small, 1e-10);
  EXPECT_LT(large, 1e-10);
  figure::print("ekf_from_by_hand", std::max(small, large), "deviations");
}
TEST(Navigation, DerivedFactoredFilterIsTheHandWrittenOne) {
  const double small = farthest(jml::Factored{jml::Ekf{}}, 0.01, 0.1),
               large = farthest(jml::Factored{jml::Ekf{}}, 0.1, 1);
  EXPECT_LT(small, 1e-10);
  EXPECT_LT(large, 1e-10);
  figure::print("factored_from_by_hand", std::max(small, large), "deviations");
}
// What the comparison can see.
TEST(Navigation, WithoutTheResetItIsAnother) { EXPECT_GT(farthest(jml::Ekf{}, 0.01, 0.1, false), 1e-4); }

}  // namespace
