// SPDX-License-Identifier: BSD-3-Clause
// Noise as an argument: x⁺ = x exp(w) and y = x (1 + v). The criterion is ½ (x_0 - x̂)²/P + ½ Σ w²/Q + ½ Σ
// v²/R subject to these equations, without a log-determinant. The oracle is its dense minimum: v is y/x - 1,
// the unknowns are x_0 and the w, and gradient and Hessian are written down here.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <jml/jml.hpp>
#include <jml/model/correlated_noise.hpp>
#include <random>
#include <vector>

namespace {

struct Growth {
  static constexpr int states = 1, disturbances = 1;
  double Q = 0.01;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& w) const {
    using std::exp;
    return jml::Vector<T, 1>(x(0) * exp(w(0)));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(Q); }
};

struct Scale {
  static constexpr int measurements = 1;
  double R = 0.04;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& v) const {
    return jml::Vector<T, 1>(x(0) * (v(0) + 1.0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(R); }
};

/// One step from x̂, P.
struct Flight {
  double x0 = 2, P = 0.1, Q = 0.01, R = 0.04, C = 0;  // C = E[w v]
  std::vector<double> y;

  [[nodiscard]] double determinant() const { return Q * R - C * C; }
  /// Twice its part of J.
  [[nodiscard]] double cost_of(double w, double v) const {
    return (R * w * w - 2 * C * w * v + Q * v * v) / determinant();
  }
};

/// (x_0, w_0, …) of the dense minimum, by Newton's method from the prior with halved steps.
Eigen::VectorXd dense_minimum(const Flight& flight) {
  const auto count = static_cast<Eigen::Index>(flight.y.size());
  Eigen::VectorXd z = Eigen::VectorXd::Zero(count + 1), g(count + 1);
  Eigen::MatrixXd H(count + 1, count + 1);
  z(0) = flight.x0;
  const auto cost = [&](const Eigen::VectorXd& at) {
    double J = (at(0) - flight.x0) * (at(0) - flight.x0) / flight.P, x = at(0);
    for (Eigen::Index k = 0; k < count; ++k) {
      x *= std::exp(at(k + 1));
      const double v = flight.y[static_cast<std::size_t>(k)] / x - 1;
      J += flight.cost_of(at(k + 1), v);
    }
    return J / 2;
  };
  for (int iteration = 0; iteration < 100; ++iteration) {
    g.setZero();
    H.setZero();
    g(0) = (z(0) - flight.x0) / flight.P;
    H(0, 0) = 1 / flight.P;
    double x = z(0);
    for (Eigen::Index k = 0; k < count; ++k) {
      x *= std::exp(z(k + 1));
      // u = y / x: ∂u/∂w = -u of every w so far, ∂u/∂x_0 = -u / x_0.
      const double u = flight.y[static_cast<std::size_t>(k)] / x, v = u - 1;
      Eigen::VectorXd slope = Eigen::VectorXd::Zero(count + 1);
      slope.segment(1, k + 1).setConstant(-u);
      slope(0) = -u / z(0);
      Eigen::MatrixXd bend = slope * slope.transpose() / u;
      bend(0, 0) = 2 * u / (z(0) * z(0));
      const double w = z(k + 1), by_w = (flight.R * w - flight.C * v) / flight.determinant(),
                   by_v = (flight.Q * v - flight.C * w) / flight.determinant();
      g(k + 1) += by_w;
      g += by_v * slope;
      H(k + 1, k + 1) += flight.R / flight.determinant();
      H.row(k + 1) -= flight.C / flight.determinant() * slope.transpose();
      H.col(k + 1) -= flight.C / flight.determinant() * slope;
      H += flight.Q / flight.determinant() * slope * slope.transpose() + by_v * bend;
    }
    if (g.norm() < 1e-13) break;
    // Where the Hessian is not positive definite, more of its diagonal.
    double more = 0;
    while (Eigen::LLT<Eigen::MatrixXd>(H + more * Eigen::MatrixXd::Identity(count + 1, count + 1)).info() !=
           Eigen::Success)
      more = more == 0 ? 1 : 2 * more;
    H.diagonal().array() += more;
    const Eigen::VectorXd step = H.ldlt().solve(-g);
    double share = 1;
    while (share > 1e-6 && cost(z + share * step) > cost(z)) share /= 2;
    z += share * step;
  }
  return z;
}

Flight random_flight(std::mt19937_64& random, int steps, double correlation = 0) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Flight flight;
  flight.P = 0.02 + 0.2 * uniform(random);
  flight.Q = 1e-3 + 0.03 * uniform(random);
  flight.R = 0.01 + 0.05 * uniform(random);
  flight.C = correlation * std::sqrt(flight.Q * flight.R);
  double x = flight.x0 + std::sqrt(flight.P) * normal(random);
  for (int k = 0; k < steps; ++k) {
    const double w = normal(random),
                 v = correlation * w + std::sqrt(1 - correlation * correlation) * normal(random);
    x *= std::exp(std::sqrt(flight.Q) * w);
    flight.y.push_back(x * (1 + std::sqrt(flight.R) * v));
  }
  return flight;
}

jml::Estimate<double, 1> start_of(const Flight& flight) {
  return {jml::Vector<double, 1>(flight.x0), jml::Matrix<double, 1, 1>(flight.P)};
}

template <typename Method>
void expect_exact_steps(const Method& method) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 200; ++i) {
    const Flight flight = random_flight(random, 1);
    const Eigen::VectorXd z = dense_minimum(flight);
    jml::Filter filter{method, Growth{flight.Q}, start_of(flight)};
    const auto report = filter.step(Scale{flight.R}, flight.y[0]);
    ASSERT_EQ(report.status, jml::Status::ok) << i << ' ' << jml::describe(report.status);
    EXPECT_NEAR(filter.x()(0), z(0) * std::exp(z(1)), 1e-9) << i;
  }
}

TEST(NoiseArgument, ExactStepIsTheDenseMinimum) { expect_exact_steps(jml::Iterated<jml::Ekf<>>{}); }
TEST(NoiseArgument, SoIsThatOfIteratedJml) { expect_exact_steps(jml::IteratedJml{}); }

TEST(NoiseArgument, BatchIsTheDenseMinimum) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 100; ++i) {
    const Flight flight = random_flight(random, 20);
    const Eigen::VectorXd z = dense_minimum(flight);
    jml::Batch batch{Growth{flight.Q}, jml::sensors<Scale>, start_of(flight), {.steps = 20}};
    for (const double y : flight.y) ASSERT_EQ(batch.step(Scale{flight.R}, y).status, jml::Status::ok);
    const auto report = batch.solve();
    ASSERT_EQ(report.status, jml::Status::ok) << i << ' ' << jml::describe(report.status);
    double x = z(0), cost = (z(0) - flight.x0) * (z(0) - flight.x0) / flight.P;
    EXPECT_NEAR(batch.x(0)(0), x, 1e-8) << i;
    for (int k = 1; k <= 20; ++k) {
      x *= std::exp(z(k));
      const double v = flight.y[static_cast<std::size_t>(k - 1)] / x - 1;
      cost += flight.cost_of(z(k), v);
      EXPECT_NEAR(batch.x(k)(0), x, 1e-8) << i << ' ' << k;
      EXPECT_NEAR(batch.w(k - 1)(0), z(k), 1e-8) << i << ' ' << k;
    }
    EXPECT_NEAR(report.cost, cost / 2, 1e-8) << i;
  }
}

// Additive dynamics beside a sensor whose noise is not: they say the space they live in, and are run locally.
struct Still {
  using Space = jml::Euclidean<1>;
  static constexpr int disturbances = 1;
  double Q = 0.01;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(Q); }
};
TEST(NoiseArgument, BesideAdditiveDynamics) {
  std::mt19937_64 random(10);
  for (int i = 0; i < 100; ++i) {
    const Flight flight = random_flight(random, 1);
    // x_1 alone, of prior variance P + Q.
    Flight one = flight;
    one.P += flight.Q;
    one.Q = 1e-30;
    const Eigen::VectorXd z = dense_minimum(one);
    jml::Filter filter{jml::Iterated<jml::Ekf<>>{}, Still{flight.Q}, start_of(flight)};
    ASSERT_EQ(filter.step(Scale{flight.R}, flight.y[0]), jml::Status::ok) << i;
    EXPECT_NEAR(filter.x()(0), z(0), 1e-9) << i;
  }
}

// Correlation 0.6 of w and v of a step: the state remembers w.
TEST(NoiseArgument, CorrelatedNoiseInStepAndBatch) {
  std::mt19937_64 random(9);
  for (int i = 0; i < 60; ++i) {
    const Flight flight = random_flight(random, i < 30 ? 1 : 10, 0.6);
    const Eigen::VectorXd z = dense_minimum(flight);
    const jml::RemembersDisturbance whole{Growth{flight.Q}};
    const auto sensor = jml::correlated(whole, Scale{flight.R}, jml::Matrix<double, 1, 1>(flight.C));
    const jml::Estimate start{jml::Vector<double, 2>(flight.x0, 0),
                              jml::Matrix<double, 2, 2>(jml::Vector<double, 2>(flight.P, 0).asDiagonal())};
    if (i < 30) {
      jml::Filter filter{jml::Iterated<jml::Ekf<>>{}, whole, start};
      ASSERT_EQ(filter.step(sensor, flight.y[0]), jml::Status::ok) << i;
      EXPECT_NEAR(filter.x()(0), z(0) * std::exp(z(1)), 1e-8) << i;
      EXPECT_NEAR(filter.x()(1), z(1), 1e-8) << i;
      continue;
    }
    jml::Batch batch{whole, jml::sensors<std::remove_const_t<decltype(sensor)>>, start, {.steps = 10}};
    for (const double y : flight.y) ASSERT_EQ(batch.step(sensor, y), jml::Status::ok);
    const auto report = batch.solve();
    ASSERT_TRUE(jml::usable(report.status)) << i << ' ' << jml::describe(report.status);
    double x = z(0);
    for (int k = 1; k <= 10; ++k) {
      x *= std::exp(z(k));
      EXPECT_NEAR(batch.x(k)(0), x, 1e-7) << i << ' ' << k;
    }
  }
}

}  // namespace
