// SPDX-License-Identifier: BSD-3-Clause
// The true flight of a discrete model: the recursion, its noise of every kind, its times and controls.
#include <gtest/gtest.h>

#include <functional>
#include <jml/campaign/flight.hpp>

namespace {

using namespace jml::operators;

using Number = jml::Matrix<double, 1, 1>;

/// x⁺ = 2 x + u + t + 3 w: every argument shows in the number.
struct Counting {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(2.0 * x(0) + at.control(0) + at.time);
  }
  Number disturbance_input() const { return Number(3.0); }
  Number disturbance_covariance() const { return Number(q); }
  jml::Vector<double, 1> disturbance_bound() const { return Number(0.5); }
  double q = 0;
};
/// y = x + 10 t + v.
struct Clocked {
  static constexpr int measurements = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + 10 * at.time);
  }
  template <typename At>
  Number noise_covariance(const jml::Vector<double, 1>&, const At&) const {
    return Number(r);
  }
  jml::Vector<double, 1> noise_bound() const { return Number(0.25); }
  double r = 0;
};

jml::Flight<1, 1, 1> flight_of(int steps) {
  jml::Flight<1, 1, 1> flight;
  flight.resize(steps);
  flight.dt = 0.5;
  return flight;
}

TEST(Flight, WithoutNoiseTheRecursionByHand) {
  auto flight = flight_of(3);
  flight.measured_at_start = true;
  flight.control = {Number(1.0), Number(2.0), Number(4.0)};
  jml::CounterNoise noise(1, 0);
  // Q = 0 and R = 0 draw numbers and use none of them.
  jml::simulate(Counting{}, Clocked{}, jml::Vector<double, 1>(1.0), jml::GaussianNoise{},
                jml::GaussianNoise{}, noise, flight);
  const double truth[] = {1, 3, 8.5, 22};  // 2·1+1+0, 2·3+2+0.5, 2·8.5+4+1
  for (std::size_t k = 0; k <= 3; ++k) {
    EXPECT_EQ(flight.truth[k](0), truth[k]) << k;
    EXPECT_EQ(flight.y[k](0), truth[k] + 5.0 * static_cast<double>(k)) << k;
  }
}

TEST(Flight, UnmeasuredAtTheStartLeavesTheFirstMeasurementZero) {
  auto flight = flight_of(1);
  jml::CounterNoise noise(1, 0);
  jml::simulate(Counting{1}, Clocked{1}, jml::Vector<double, 1>(1.0), jml::GaussianNoise{},
                jml::GaussianNoise{}, noise, flight);
  EXPECT_EQ(flight.y[0](0), 0);
}

/// w_k and v_k of a flight, read back from it; u = 0.
template <typename W, typename V>
void read_noise(const W& kind_of_w, const V& kind_of_v, const std::function<void(double w, double v)>& see) {
  auto flight = flight_of(10);
  for (std::uint64_t run = 0; run < 2000; ++run) {
    jml::CounterNoise noise(2, run);
    jml::simulate(Counting{4}, Clocked{9}, jml::Vector<double, 1>(0.0), kind_of_w, kind_of_v, noise, flight);
    for (std::size_t k = 1; k <= 10; ++k) {
      const double time = 0.5 * static_cast<double>(k);
      see((flight.truth[k](0) - 2 * flight.truth[k - 1](0) - (time - 0.5)) / 3,
          flight.y[k](0) - flight.truth[k](0) - 10 * time);
    }
  }
}

// 20 000 numbers; standard error of a mean square √(2/n) of it (normal), √(4/5/n) (uniform); 4 of them.
TEST(Flight, GaussianNoiseHasTheModelsVariances) {
  double w2 = 0, v2 = 0, wv = 0;
  read_noise(jml::GaussianNoise{}, jml::GaussianNoise{}, [&](double w, double v) {
    w2 += w * w / 20000;
    v2 += v * v / 20000;
    wv += w * v / 20000;
  });
  EXPECT_NEAR(w2, 4, 4 * 4 * std::sqrt(2.0 / 20000));
  EXPECT_NEAR(v2, 9, 4 * 9 * std::sqrt(2.0 / 20000));
  EXPECT_NEAR(wv, 0, 4 * 6 / std::sqrt(20000.0));
}

TEST(Flight, UniformNoiseFillsItsBounds) {
  double w2 = 0, v2 = 0, w_most = 0, v_most = 0;
  read_noise(jml::UniformNoise{}, jml::UniformNoise{}, [&](double w, double v) {
    w2 += w * w / 20000;
    v2 += v * v / 20000;
    w_most = std::max(w_most, std::abs(w));
    v_most = std::max(v_most, std::abs(v));
  });
  // Read back by subtraction from numbers up to 1e4: 1e-11.
  EXPECT_LE(w_most, 0.5 + 1e-11);
  EXPECT_GT(w_most, 0.499);
  EXPECT_LE(v_most, 0.25 + 1e-11);
  EXPECT_GT(v_most, 0.2495);
  EXPECT_NEAR(w2, 0.25 / 3, 4 * 0.25 / 3 * std::sqrt(0.8 / 20000));
  EXPECT_NEAR(v2, 0.0625 / 3, 4 * 0.0625 / 3 * std::sqrt(0.8 / 20000));
}

TEST(Flight, BangBangStaysAtItsBounds) {
  int up = 0;
  read_noise(jml::BangBang{}, jml::BangBang{}, [&](double w, double v) {
    ASSERT_NEAR(std::abs(w), 0.5, 1e-11);
    ASSERT_NEAR(std::abs(v), 0.25, 1e-11);
    up += w > 0;
  });
  EXPECT_NEAR(up, 10000, 4 * std::sqrt(5000.0));
}

TEST(Flight, ACallableIsTheNoise) {
  const auto w = [](const auto& x, const auto& at, jml::CounterNoise&) { return Number(x(0) + at.time); };
  const auto v = [](const auto&, const auto& at, jml::CounterNoise&) { return Number(-at.time); };
  auto flight = flight_of(2);
  jml::CounterNoise noise(1, 0);
  jml::simulate(Counting{}, Clocked{}, jml::Vector<double, 1>(1.0), w, v, noise, flight);
  EXPECT_EQ(flight.truth[1](0), 5);                // 2·1 + 0 + 3·(1 + 0)
  EXPECT_EQ(flight.truth[2](0), 10 + 0.5 + 16.5);  // 2·5 + 0.5 + 3·(5 + 0.5)
  EXPECT_EQ(flight.y[2](0), 27 + 10 - 1);
}

TEST(Flight, AVarianceBelowZeroMakesNoNumbers) {
  auto flight = flight_of(1);
  jml::CounterNoise noise(1, 0);
  jml::simulate(Counting{-1}, Clocked{-1}, jml::Vector<double, 1>(1.0), jml::GaussianNoise{},
                jml::GaussianNoise{}, noise, flight);
  EXPECT_TRUE(std::isnan(flight.truth[1](0)));
  EXPECT_TRUE(std::isnan(flight.y[1](0)));
}

}  // namespace
