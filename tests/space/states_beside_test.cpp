// SPDX-License-Identifier: BSD-3-Clause
// Correlated and coloured noise by states beside the plant's, against linear filters written out here.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <jml/jml.hpp>
#include <jml/model/coloured_noise.hpp>
#include <jml/model/correlated_noise.hpp>
#include <jml/model/discretize.hpp>

namespace {

// Two disturbances, two noises and a C without symmetry: one step by S = H N Hᵀ + R + H C + Cᵀ Hᵀ and
// K = (N Hᵀ + C) S⁻¹, written down here.
struct Pair {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  jml::Matrix<double, 2, 2> F{{1, 0.3}, {-0.2, 0.9}}, Q{{0.5, 0.1}, {0.1, 0.3}};
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 2>(F(0, 0) * x(0) + F(0, 1) * x(1), F(1, 0) * x(0) + F(1, 1) * x(1));
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const { return Q; }
};
struct Seen {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  jml::Matrix<double, 2, 2> H{{1, 0.5}, {0.2, -1}}, R{{0.4, 0.05}, {0.05, 0.6}};
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 2>(H(0, 0) * x(0) + H(0, 1) * x(1), H(1, 0) * x(0) + H(1, 1) * x(1));
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return R; }
};
TEST(StatesBeside, CorrelationsOfTwoByTwo) {
  using Square = jml::Matrix<double, 2, 2>;
  const Pair plant;
  const Seen seen;
  const Square C{{0.12, -0.05}, {0.2, 0.08}}, P{{1, 0.2}, {0.2, 0.7}};
  const jml::Vector<double, 2> x(1, -2), y(0.4, 1.1);
  jml::Matrix<double, 4, 4> P0 = jml::Matrix<double, 4, 4>::Zero();
  P0.topLeftCorner<2, 2>() = P;
  const jml::RemembersDisturbance whole{plant};
  jml::Filter filter{jml::Ekf{}, whole, jml::Estimate{jml::Vector<double, 4>(1, -2, 0, 0), P0}};
  ASSERT_EQ(filter.step(jml::correlated(whole, seen, C), y), jml::Status::ok);
  const Square N = plant.F * P * plant.F.transpose() + plant.Q;
  const Square S = seen.H * N * seen.H.transpose() + seen.R + seen.H * C + (seen.H * C).transpose();
  const Square K = (N * seen.H.transpose() + C) * S.inverse();
  const jml::Vector<double, 2> bar = plant.F * x, expected = bar + K * (y - seen.H * bar);
  EXPECT_LT((filter.x().head<2>() - expected).norm(), 1e-14);
  EXPECT_LT((filter.P().topLeftCorner<2, 2>() - (N - K * S * K.transpose())).norm(), 1e-14);
}

// A first-order Gauss-Markov error of a position sensor: the filter of (x, ξ) written out as one linear
// model.
struct Walk {
  static constexpr int states = 1, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};
struct GaussMarkov {
  static constexpr int states = 1, disturbances = 1;
  using time_domain = jml::ContinuousTime;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * -0.5);
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.2); }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.04); }
};

TEST(StatesBeside, ColouredNoiseIsOneMoreState) {
  const double dt = 0.4, decay = std::exp(-0.5 * dt), shaped = 0.2 * (1 - decay * decay);
  const jml::ColouredNoise whole{Walk{}, jml::discretize<jml::RungeKutta4>(GaussMarkov{})};
  const auto sensor = jml::with_coloured_noise(whole, Position{}, jml::Matrix<double, 1, 1>(1.0));
  jml::Matrix<double, 2, 2> P = jml::Vector<double, 2>(1.0, 0.2).asDiagonal();
  jml::Filter filter{jml::Ekf{}, whole, jml::Estimate{jml::Vector<double, 2>(0, 0), P}};
  jml::Vector<double, 2> x(0, 0);
  for (const double y : {0.3, 0.5, 0.1, 0.9}) {
    ASSERT_EQ(filter.step(sensor, y, dt), jml::Status::ok);
    const jml::Vector<double, 2> phi(1, decay), h(1, 1);
    x = phi.cwiseProduct(x);
    P = (phi.asDiagonal() * P * phi.asDiagonal()).eval();
    P(0, 0) += 0.01;
    P(1, 1) += shaped;
    const double S = h.dot(P * h) + 0.04;
    const jml::Vector<double, 2> K = P * h / S;
    x += K * (y - h.dot(x));
    P -= (K * S * K.transpose()).eval();
    EXPECT_NEAR(filter.x()(0), x(0), 1e-5);  // e^(-0.2) by one step of Runge-Kutta is off by 2.7e-6
    EXPECT_NEAR(filter.P()(0, 0), P(0, 0), 3e-6);
  }
}

}  // namespace
