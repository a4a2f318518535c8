// SPDX-License-Identifier: BSD-3-Clause
// Long intervals of unstable systems, where a run of the model from x_0 alone means nothing: Batch still
// finds the minimum. Stationarity is checked in coordinates in which it is local, so nothing grows.
#include <gtest/gtest.h>

#include <jml/filter/factored.hpp>
#include <jml/filter/filter.hpp>
#include <jml/interval/batch.hpp>

#include "models/linear.hpp"
#include "models/pendulum.hpp"

namespace {

using namespace jml::operators;

using jml::Matrix, jml::Vector;

/// Standing upright and held there by a torque; only the noise is not known. Semi-implicit Euler.
struct InvertedPendulum {
  static constexpr int states = 2, disturbances = 1, controls = 1;
  double h = 0.05, stiffness = 9.80665, damping = 0.1, variance = 0.05;

  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    using std::sin;
    const T rate = (1.0 - h * damping) * x(1) + h * (stiffness * sin(x(0)) + at.control(0));
    return {x(0) + h * rate, rate};
  }
  Matrix<double, 2, 1> disturbance_input() const { return {h * h, h}; }
  Matrix<double, 1, 1> disturbance_covariance() const { return Matrix<double, 1, 1>(variance); }
};

// The next rate is the difference of two angles, so every sequence of angles from -1 to N is a trajectory,
// and each angle enters three disturbances.
TEST(BatchLong, InvertedPendulum) {
  constexpr int steps = 2000;
  const InvertedPendulum d;
  const models::SineSensor sensor{.r = 1e-3};
  const jml::Estimate<double, 2> prior{{0.05, 0.1}, 0.01 * Matrix<double, 2, 2>::Identity()};
  jml::Batch batch{d, jml::sensors<models::SineSensor>, prior, {steps}};
  jml::Noise noise(31);
  Vector<double, 2> truth = prior.x + noise.normal_vector(prior.P), open = prior.x;
  std::vector<double> u(steps), y(steps + 1);
  for (std::size_t k = 0; k < steps; ++k) {
    u[k] = -25 * truth(0) - 8 * truth(1);
    const jml::StepContext<double, 1> at{0, 0, Vector<double, 1>(u[k])};
    truth = (d.dynamics(truth, at) + d.disturbance_input() * std::sqrt(d.variance) * noise.normal()).eval();
    open = d.dynamics(Vector<double, 2>(open), at);
    y[k + 1] = std::sin(truth(0)) + std::sqrt(sensor.r) * noise.normal();
    ASSERT_EQ(batch.step(sensor, y[k + 1], d.h, at.control), jml::Status::ok);
  }
  ASSERT_GT(std::abs(open(0) - truth(0)), 1.0) << "the prediction must have fallen over";
  const auto report = batch.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_LE(report.iterations, 10);

  const auto angle = [&](int k) { return k < 0 ? batch.x(0)(0) - d.h * batch.x(0)(1) : batch.x(k)(0); };
  /// w_k, with its slopes by angles k - 1, k, k + 1.
  const auto disturbance = [&](int k) {
    using T = jml::Dual<double, 3>;
    const auto a = jml::seed(Vector<double, 3>(angle(k - 1), angle(k), angle(k + 1)));
    const T before = (a(1) - a(0)) / T(d.h), after = (a(2) - a(1)) / T(d.h);
    const double torque = u[static_cast<std::size_t>(k)];
    return (after - (1.0 - d.h * d.damping) * before) / T(d.h) - d.stiffness * sin(a(1)) - torque;
  };
  double cost = (batch.x(0) - prior.x).squaredNorm() / prior.P(0, 0) / 2, scale = 0, largest = 0;
  for (int k = 0; k <= steps; ++k) {
    double slope = 0, size = 0;
    const auto add = [&](double term) {
      slope += term;
      size += std::abs(term);
    };
    for (int j = std::max(0, k - 1); j <= std::min(k + 1, steps - 1); ++j) {
      const auto w = disturbance(j);
      add(w.value * w.partial[1 + k - j] / d.variance);
    }
    if (k == 0) {
      add((batch.x(0)(0) - prior.x(0)) / prior.P(0, 0));
      add((batch.x(0)(1) - prior.x(1)) / prior.P(1, 1) / d.h);
    } else {
      const double r = y[static_cast<std::size_t>(k)] - std::sin(angle(k));
      add(-r * std::cos(angle(k)) / sensor.r);
      cost += r * r / sensor.r / 2;
    }
    largest = std::max(largest, std::abs(slope));
    scale = std::max(scale, size);
    if (k == steps) break;
    const double w = disturbance(k).value;
    EXPECT_NEAR(batch.w(k)(0), w, 1e-10) << k;
    EXPECT_NEAR(batch.x(k + 1)(1), (angle(k + 1) - angle(k)) / d.h, 1e-12) << k;
    cost += w * w / d.variance / 2;
  }
  EXPECT_LE(largest, 1e-8 * scale);
  EXPECT_NEAR(report.cost, cost, 1e-9 * cost);
  // A sane answer, too: within five standard deviations of the truth at the end.
  const Matrix<double, 2, 2> P = batch.P(steps);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(batch.x(steps)(i), truth(i), 5 * std::sqrt(P(i, i)));
}

// 1.5^2000 is beyond double: the model alone cannot be run. With q = n each state is free, and enters J
// with its two neighbours only.
TEST(BatchLong, UnstableLinearSystem) {
  constexpr int steps = 2000;
  models::LinearDynamics<2, 2> d;
  d.F << 1.5, 0.1, -0.2, 1.4;
  d.G.setIdentity();
  d.Q << 0.2, 0.05, 0.05, 0.1;
  models::LinearSensor<2, 1> s;
  s.M << 1, 0.5;
  s.R << 0.1;
  jml::Estimate<double, 2> prior{{0.3, -0.2}, Matrix<double, 2, 2>::Identity()};
  jml::Noise noise(32);
  jml::Batch batch{d, jml::sensors<models::LinearSensor<2, 1>>, prior, {steps}};
  std::vector<double> y(steps + 1);
  Vector<double, 2> open = prior.x;
  for (std::size_t k = 1; k <= steps; ++k) {
    y[k] = noise.normal();
    ASSERT_EQ(batch.step(s, y[k]), jml::Status::ok);
    open = d.dynamics(Vector<double, 2>(open));
  }
  ASSERT_FALSE(jml::all_finite(open));
  const auto report = batch.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_LE(report.iterations, 2);
  EXPECT_FALSE(std::isnan(report.gradient)) << "ok, and no number for the gradient";

  const double det = d.Q(0, 0) * d.Q(1, 1) - d.Q(0, 1) * d.Q(1, 0);
  Matrix<double, 2, 2> weight;
  weight << d.Q(1, 1) / det, -d.Q(0, 1) / det, -d.Q(1, 0) / det, d.Q(0, 0) / det;
  const auto jump = [&](int k) { return Vector<double, 2>(batch.x(k + 1) - d.F * batch.x(k)); };
  double cost = (batch.x(0) - prior.x).squaredNorm() / 2, scale = 0, largest = 0;
  for (int k = 0; k <= steps; ++k) {
    Vector<double, 2> slope = k == 0 ? Vector<double, 2>(batch.x(0) - prior.x) : weight * jump(k - 1);
    scale = std::max(scale, slope.norm());
    if (k < steps) {
      slope -= d.F.transpose() * weight * jump(k);
      cost += jump(k).dot(weight * jump(k)) / 2;
      EXPECT_LE((batch.w(k) - jump(k)).norm(), 1e-12) << k;
    }
    if (k > 0) {
      const double r = y[static_cast<std::size_t>(k)] - (s.M * batch.x(k))(0);
      slope -= s.M.transpose() * r / s.R(0, 0);
      cost += r * r / s.R(0, 0) / 2;
    }
    largest = std::max(largest, slope.norm());
  }
  EXPECT_LE(largest, 1e-12 * scale);
  EXPECT_NEAR(report.cost, cost, 1e-12 * cost);

  // Far from both ends P has forgotten them.
  const Matrix<double, 2, 2> early = batch.P(700), late = batch.P(1300);
  EXPECT_GT(early(0, 0), 0);
  EXPECT_LE((early - late).norm(), 1e-13 * early.norm());
}

// Rounding of a pass, to first order: of every Λ an ε of its diagonal, and of what the step before it makes
// of that, each in the direction in which the data leave the state. Λ and P by covariances and their inverses
// here.
TEST(BatchLong, APassByTheCovariances) {
  using Square = Matrix<double, 2, 2>;
  constexpr int steps = 12;
  models::LinearDynamics<2, 2> d;
  d.F << 1.5, 0.1, -0.2, 0.7;
  d.G << 1, 0.3, -0.5, 2;
  d.Q << 0.2, 0.05, 0.05, 0.1;
  models::LinearSensor<2, 1> s;
  s.M << 1, 0.5;
  s.R << 0.1;
  jml::Estimate<double, 2> prior{{0.3, -0.2}, Square::Identity()};
  prior.P << 2, 0.5, 0.5, 0.8;
  jml::Batch batch{d, jml::sensors<models::LinearSensor<2, 1>>, prior, {steps}};
  for (int k = 0; k < steps; ++k) ASSERT_EQ(batch.step(s, 0.1 * k), jml::Status::ok);
  auto& store = batch.recording();
  jml::detail::PassSums<double> sums;
  jml::detail::Sweep sweep(store, jml::Loss{});
  ASSERT_TRUE(sweep.backward(true, 0, sums));

  const auto inverse = [](const Square& a) {
    Square out;
    out << a(1, 1), -a(0, 1), -a(1, 0), a(0, 0);
    return Square(out / (a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0)));
  };
  const auto diagonal = [](const Square& a) {
    Square out = Square::Zero();
    out(0, 0) = a(0, 0);
    out(1, 1) = a(1, 1);
    return out;
  };
  const Square of_row = s.M.transpose() * s.M / s.R(0, 0), noise = d.G * d.Q * d.G.transpose();
  std::vector<Square> before{prior.P}, later(steps + 1);  // P given the data before a node; Λ from it on
  for (std::size_t k = 0; k < steps; ++k) {
    Square left = inverse(before[k]);
    if (k > 0) left += of_row;
    before.push_back(d.F * inverse(left) * d.F.transpose() + noise);
  }
  double expected = 0;
  for (std::size_t k = steps + 1; k-- > 0;) {
    Square lost = Square::Zero(), C = Square::Identity();
    later[k] = k == 0 ? lost : of_row;
    if (k < steps) {
      C += later[k + 1] * noise;
      later[k] += d.F.transpose() * inverse(C) * later[k + 1] * d.F;
      lost = diagonal(d.F.transpose() * diagonal(later[k + 1]) * d.F);
    }
    lost += diagonal(later[k]);
    const Square P = inverse(Square(inverse(before[k]) + later[k]));
    for (int i = 0; i < 2; ++i) expected += lost(i, 0) * P(0, i) + lost(i, 1) * P(1, i);
  }
  EXPECT_NEAR(sums.noise, 4 * expected, 1e-12 * expected);

  // The law of Newton's pass, from w = 0: x⁺ = (I + Q Λ)⁻¹ (F x - Q λ), with Q for G Q Gᵀ.
  ASSERT_TRUE(sweep.backward<jml::detail::Curvature::full>(false, 0, sums));
  Vector<double, 2> slope = Vector<double, 2>::Zero();
  for (int k = steps; k > 0; --k) {
    const auto& law = store.node(k).law;
    const Square B = store.root(k).B, L = later[static_cast<std::size_t>(k)];
    slope -= s.M.transpose() * ((0.1 * (k - 1) - (s.M * batch.x(k))(0)) / s.R(0, 0));
    const Square C = Square::Identity() + noise * L, left = inverse(C);
    const Vector<double, 2> moved = -(left * (noise * slope));
    EXPECT_LE((B * law.offset - moved).norm(), 1e-12 * (1 + moved.norm())) << k;
    EXPECT_LE((d.F + B * law.gain - left * d.F).norm(), 1e-12) << k;
    slope = d.F.transpose() * (slope + L * moved);
  }
}

/// Led by a control.
struct Led : models::LinearDynamics<2, 2> {
  static constexpr int controls = 2;
  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    return F.template cast<T>() * x + at.control.template cast<T>();
  }
};

// The first pass finds no ε of a state that tells later, a second one does: its nominal was led along in
// doubles, and F made 1.9^60 of their rounding where that was followed in twice the digits. No step lowered J
// (of 100 such flights it was so with 63). At the end the answer is the filter's.
TEST(BatchLong, TwiceTheDigitsFromTheSecondPassOn) {
  constexpr int steps = 60;
  Led d;
  d.F << 1.43, -0.68, -0.37, 1.43;
  d.G.setIdentity();
  d.Q << 0.13, 0, 0, 4e-14;
  models::LinearSensor<2, 1> s;
  s.M << 0.76, -0.0093;
  s.R << 2.9e-15;
  jml::Estimate<double, 2> prior{{0.5, -0.9}, Matrix<double, 2, 2>::Zero()};
  prior.P.diagonal() << 290, 0.0056;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    jml::Noise noise(seed);
    jml::Batch batch{d, jml::sensors<models::LinearSensor<2, 1>>, prior, {steps}};
    jml::Filter filter{jml::Factored{jml::Kalman{}}, d, prior};
    Vector<double, 2> truth = prior.x;
    for (int i = 0; i < 2; ++i) truth(i) += std::sqrt(prior.P(i, i)) * noise.normal();
    for (int k = 1; k <= steps; ++k) {
      Vector<double, 2> next(0.5 * std::sin(0.3 * k), 0.5 * std::cos(0.3 * k));
      const Vector<double, 2> control = next - d.F * truth;
      for (int i = 0; i < 2; ++i) next(i) += std::sqrt(d.Q(i, i)) * noise.normal();
      truth = next;
      const double y = (s.M * truth)(0) + std::sqrt(s.R(0)) * noise.normal();
      ASSERT_EQ(batch.step(s, y, 1, control), jml::Status::ok);
      ASSERT_EQ(filter.step(s, y, 1, control), jml::Status::ok);
    }
    ASSERT_TRUE(jml::usable(batch.solve().status)) << seed;
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(batch.x(steps)(i), filter.x()(i), 1e-6 * std::sqrt(filter.P()(i, i))) << seed;
  }
}

}  // namespace
