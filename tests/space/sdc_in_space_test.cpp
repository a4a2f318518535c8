// SPDX-License-Identifier: BSD-3-Clause
// Models in local coordinates: SDC matrices about the origin of a space, and a model's own Jacobians away
// from the point where a chart stands. What they have to be is said by plus and minus alone, or by closed
// forms.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "models/attitude_in_space.hpp"

namespace {

using State = jml::Vector<double, 4>;
using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Turning = models::TurningIn<jml::SO3>;
using models::VectorSensor;

/// A body that rights itself: x⁺ = x Exp(k e × Rᵀ e + spin e), e = (0, 0, 1); G depends on x.
struct Righting {
  using Space = jml::SO3;
  static constexpr int disturbances = 2;
  double k = 0.4, spin = 0.3;  // rad
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    const jml::Vector<T, 3> down = jml::rotate_back(x, jml::Vector<T, 3>(T(0), T(0), T(1)));
    return jml::SO3::plus(x, jml::Vector<T, 3>(-k * down(1), k * down(0), T(spin)));
  }
  jml::Matrix<double, 3, 2> disturbance_input(const State& x) const {
    jml::Matrix<double, 3, 2> G;
    G << 1 + x(1) * x(1), x(2), 0.5, x(3), -x(0), 2;
    return G;
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    return 1e-4 * jml::Matrix<double, 2, 2>::Identity();
  }
};
/// The same with its own Jacobian, ∂ (f(x ⊞ δ) ⊟ f(x)): Exp(-u) + J_r(u) ∂u by hand.
struct RightingByHand : Righting {
  Matrix3 dynamics_jacobian(const State& x) const {
    const Vector3 down = jml::rotate_back(x, Vector3(0, 0, 1));
    const Vector3 u{-k * down(1), k * down(0), spin};
    const auto cross = [](const Vector3& v) {
      Matrix3 K;
      K << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
      return K;
    };
    const double angle = u.norm();
    const Matrix3 K = cross(u), I = Matrix3::Identity(), square = K * K;
    const Matrix3 back = I - std::sin(angle) / angle * K + (1 - std::cos(angle)) / (angle * angle) * square;
    const Matrix3 J_r = I - (1 - std::cos(angle)) / (angle * angle) * K +
                        (angle - std::sin(angle)) / (angle * angle * angle) * square;
    Matrix3 pick = Matrix3::Zero();
    pick(0, 1) = -k;
    pick(1, 0) = k;
    return back + J_r * pick * cross(down);  // Rᵀ(x ⊞ δ) e = down + down × δ
  }
};
/// A vector seen, with its own Jacobian.
struct SeenByHand : VectorSensor {
  jml::Matrix<double, 3, 3> measurement_jacobian(const State& x) const {
    const Vector3 v = measurement(x);
    Matrix3 K;
    K << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
    return K;
  }
};

struct Draw {
  std::mt19937_64 random{11};
  Vector3 vector() {
    std::normal_distribution<double> normal;
    return {normal(random), normal(random), normal(random)};
  }
  Vector3 direction() { return vector().normalized(); }
  State state() { return jml::exp_quaternion(vector()); }
};

template <typename D>
jml::detail::LocalContext<double, D> chart(const D& model, const State& from, const Vector3& control = {}) {
  jml::detail::LocalContext<double, D> at;
  at.dt = 0.5;
  if constexpr (jml::DynamicsTraits<D>::controls == 3) at.control = control;
  at.from = from;
  at.to = jml::dynamics(model, from, static_cast<const typename decltype(at)::Plain&>(at));
  return at;
}
template <typename D>
Vector3 moved(const D& model, const jml::detail::LocalContext<double, D>& at, const Vector3& z) {
  const auto& plain = static_cast<const typename std::remove_cvref_t<decltype(at)>::Plain&>(at);
  return jml::SO3::minus(jml::dynamics(model, jml::SO3::plus(at.from, z), plain), at.to);
}
Vector3 to_origin(const State& from) { return jml::SO3::minus(State(1, 0, 0, 0), from); }

TEST(SdcInSpace, LeadsFromTheOriginToTheState) {
  Draw draw;
  for (int i = 0; i < 200; ++i) {
    const Righting model;
    const auto at = chart(model, draw.state());
    const Vector3 z = (i % 4 == 0 ? 1e-3 : 0.3) * draw.vector(), r = to_origin(at.from);
    const jml::detail::LocalDynamics<Righting> local{model};
    const Matrix3 F = local.dynamics_sdc(z, at);
    const Vector3 change = moved(model, at, z) - moved(model, at, r);
    EXPECT_LT((F * (z - r) - change).norm(), 1e-14 * (1 + change.norm())) << i;
    // Not any such matrix: of an f that is nearly linear between the two it is the Jacobian there.
    const Vector3 close = r + 1e-6 * draw.vector();
    const Matrix3 J = jml::dynamics_jacobian(local, r, at);
    EXPECT_LT((local.dynamics_sdc(close, at) - J).norm(), 1e-5) << i;

    const VectorSensor sensor{draw.direction()};
    const auto seen = jml::detail::local_sensor<Righting, double>(sensor);
    const Vector3 s = to_origin(at.to);
    const Matrix3 M = seen.measurement_sdc(z, at);
    const Vector3 here = sensor.measurement(jml::SO3::plus(at.to, z));
    EXPECT_LT((M * (z - s) - (here - sensor.direction)).norm(), 1e-15 * 8) << i;
  }
}
// Of a turn by a known angle φ(z) = Exp(-u) z, linear in z: F is that rotation wherever it is asked.
TEST(SdcInSpace, OfAKnownTurnIsTheTurnBack) {
  Draw draw;
  for (int i = 0; i < 100; ++i) {
    const Turning model;
    const Vector3 rate = draw.vector();
    const auto at = chart(model, jml::exp_quaternion(Vector3(0.5 * draw.vector())), rate);
    const Vector3 z = 0.3 * draw.vector();
    const Matrix3 F = jml::detail::LocalDynamics<Turning>{model}.dynamics_sdc(z, at);
    const State turn = jml::exp_quaternion(Vector3(at.dt * rate));
    for (int j = 0; j < 3; ++j)
      EXPECT_LT((F.col(j) - jml::rotate_back(turn, Vector3(Vector3::Unit(j)))).norm(), 2e-14);
  }
}

// Away from where the chart stands, and with a push: the whole chain of charts is in the Jacobian.
TEST(LocalModel, OwnJacobiansAreThoseOfTheCode) {
  Draw draw;
  for (int i = 0; i < 100; ++i) {
    auto at = chart(RightingByHand{}, draw.state());
    const Vector3 z = i == 0 ? Vector3(0, 0, 0) : Vector3(0.4 * draw.vector());
    at.to = jml::SO3::plus(at.to, Vector3(0.1 * draw.vector()));
    if (i % 2 == 0) at.w = {0.1, -0.2};
    const jml::detail::LocalDynamics<RightingByHand, true> by_hand{};
    jml::detail::LocalContext<double, Righting> same(at);
    same.from = at.from;
    same.to = at.to;
    same.w = at.w;
    const jml::detail::LocalDynamics<Righting, true> derived{};
    // G is that of the value of x: its own slope is no part of the model, as in ℝⁿ.
    EXPECT_LT((by_hand.dynamics_jacobian(z, at) - jml::dynamics_jacobian(derived, z, same)).norm(), 1e-14);
    const double h = 1e-5;
    for (int j = 0; j < 2; ++j) {
      auto more = same, less = same;
      more.w(j) += h;
      less.w(j) -= h;
      const Vector3 slope = (derived.dynamics(z, more) - derived.dynamics(z, less)) / (2 * h);
      EXPECT_LT((derived.disturbance_input(z, same).col(j) - slope).norm(), 1e-9);
    }
    const SeenByHand sensor{{draw.direction()}};
    const auto seen = jml::detail::local_sensor<RightingByHand, double>(sensor);
    const auto plain = jml::detail::local_sensor<RightingByHand, double>(VectorSensor(sensor));
    EXPECT_LT((seen.measurement_jacobian(z, at) - jml::measurement_jacobian(plain, z, at)).norm(), 1e-14);
  }
}

const Righting slow{0.4, 0.01};
struct Flight {
  State x0, truth;
  std::vector<Vector3> y;
};
/// Vectors seen alternately, of a body that starts `off` rad beside x0.
Flight fly(Draw& draw, double off, int steps, const VectorSensor (&sensors)[2]) {
  Flight flight;
  flight.x0 = jml::exp_quaternion(Vector3(0.5 * draw.vector()));
  flight.truth = jml::SO3::plus(flight.x0, Vector3(off * draw.vector()));
  for (int k = 0; k < steps; ++k) {
    flight.truth = slow.dynamics(flight.truth);
    const auto& sensor = sensors[k % 2];
    flight.y.push_back(sensor.measurement(flight.truth) + sensor.sigma * draw.vector());
  }
  return flight;
}
template <typename Method>
auto filter_of(const Method& method, const Flight& flight) {
  return jml::Filter{method, slow, jml::Estimate{flight.x0, 0.01 * Matrix3::Identity()}};
}

// check_model finds what is wrong of the models above, and nothing where nothing is.
struct RightingWrongly : RightingByHand {
  Matrix3 dynamics_jacobian(const State& x) const {
    Matrix3 J = RightingByHand::dynamics_jacobian(x);
    J(1, 2) += 1e-4;
    return J;
  }
};
TEST(LocalModel, IsChecked) {
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    const State x = jml::exp_quaternion(Vector3(normal(random), normal(random), normal(random)));
    EXPECT_TRUE(jml::check_model(Righting{}, x).ok()) << i;
    EXPECT_TRUE(jml::check_model(RightingByHand{}, x).ok()) << i;
    EXPECT_TRUE(jml::check_model(Righting{}, VectorSensor{}, x).ok()) << i;
    EXPECT_TRUE(jml::check_model(RightingWrongly{}, x)
                    .has(jml::Finding::Function::jacobian, jml::Finding::Fault::disagrees_with_differences))
        << i;
    EXPECT_TRUE(jml::check_model(Righting{}, State(1.1 * x))
                    .has(jml::Finding::Function::dynamics, jml::Finding::Fault::not_finite));
  }
}

TEST(SdcInSpace, AboutTheEstimateEveryRuleIsTheEkf) {
  Draw draw;
  const VectorSensor sensors[] = {{{1, 0, 0}, 0.01}, {{0, 0.6, 0.8}, 0.01}};
  for (int i = 0; i < 5; ++i) {
    const Flight flight = fly(draw, 0.1, 40, sensors);
    auto ekf = filter_of(jml::Ekf{}, flight);
    auto sddre = filter_of(jml::Sddre<jml::AboutEstimate>{}, flight);
    auto rule = filter_of(jml::Jml<jml::AboutEstimate>{}, flight);
    for (std::size_t k = 0; k < flight.y.size(); ++k) {
      const auto& sensor = sensors[k % 2];
      ASSERT_EQ(ekf.step(sensor, flight.y[k]).status, jml::Status::ok);
      ASSERT_EQ(sddre.step(sensor, flight.y[k]).status, jml::Status::ok);
      ASSERT_EQ(rule.step(sensor, flight.y[k]).status, jml::Status::ok);
      EXPECT_LT((ekf.x() - sddre.x()).norm(), 1e-14);
      EXPECT_LT((ekf.P() - sddre.P()).norm(), 1e-16);
      EXPECT_LT((ekf.x() - rule.x()).norm(), 1e-13);
      EXPECT_LT((ekf.P() - rule.P()).norm(), 1e-15);
    }
  }
}
/// Table 1 by hand, about the origin of the space: the matrices by differences and Simpson's rule, the update
/// of the error in the chart at the prediction, then P in the tangent where it ends.
struct ByHand {
  Righting model;
  State x;
  Matrix3 P = 0.01 * Matrix3::Identity();

  template <typename Function>
  static Matrix3 slope(const Function& f, const Vector3& z) {
    Matrix3 out;
    const double h = 1e-3;
    for (int j = 0; j < 3; ++j) {
      const Vector3 e = h * Vector3::Unit(j);
      out.col(j) = (f(z - 2 * e) - 8 * f(z - e) + 8 * f(z + e) - f(z + 2 * e)) / (12 * h);
    }
    return out;
  }
  template <typename Function>
  static Matrix3 mean_slope(const Function& f, const Vector3& r) {
    Matrix3 sum = Matrix3::Zero();
    constexpr int intervals = 40;
    for (int i = 0; i <= intervals; ++i) {
      const double weight = i == 0 || i == intervals ? 1 : (i % 2 == 1 ? 4 : 2);
      sum += weight / (3.0 * intervals) * slope(f, r * (1 - double(i) / intervals));
    }
    return sum;
  }
  void step(bool nonsymmetric, const VectorSensor& sensor, const Vector3& y) {
    const State from = x, to = model.dynamics(x);
    const auto f = [&](const Vector3& z) {
      return jml::SO3::minus(model.dynamics(jml::SO3::plus(from, z)), to);
    };
    const auto m = [&](const Vector3& z) { return sensor.measurement(jml::SO3::plus(to, z)); };
    const Vector3 zero = Vector3::Zero();
    const Matrix3 A = mean_slope(f, to_origin(from)), B = nonsymmetric ? slope(f, zero) : A;
    const Matrix3 E = mean_slope(m, to_origin(to)), D = nonsymmetric ? slope(m, zero) : E;
    const auto G = model.disturbance_input(from);
    const Matrix3 N = A * P * B.transpose() + G * model.disturbance_covariance() * G.transpose();
    const Matrix3 K = N * D.transpose() * (E * N * D.transpose() + sensor.noise_covariance()).inverse();
    const Vector3 z = K * (y - m(zero));
    x = jml::SO3::plus(to, z);
    const State end = x;
    const Matrix3 J = slope([&](const Vector3& d) { return jml::SO3::minus(jml::SO3::plus(to, d), end); }, z);
    P = J * (N - K * E * N) * J.transpose();
  }
};

// About the origin they are filters of their own. The exact step of eq. (9), from a covariance, is the
// minimum of J that the exact step of the Ekf finds.
TEST(SdcInSpace, AboutTheOriginTheyAreTableOne) {
  Draw draw;
  const VectorSensor sensors[] = {{{1, 0, 0}, 0.01}, {{0, 0.6, 0.8}, 0.01}};
  for (int i = 0; i < 10; ++i) {
    const Flight flight = fly(draw, 0.1, 20, sensors);
    auto sddre = filter_of(jml::Sddre{}, flight);
    auto rule = filter_of(jml::Jml{}, flight);
    ByHand sddre_by_hand{slow, flight.x0}, rule_by_hand{slow, flight.x0};
    for (std::size_t k = 0; k < flight.y.size(); ++k) {
      const auto& sensor = sensors[k % 2];
      ASSERT_EQ(sddre.step(sensor, flight.y[k]).status, jml::Status::ok) << i << ' ' << k;
      ASSERT_EQ(rule.step(sensor, flight.y[k]).status, jml::Status::ok) << i << ' ' << k;
      sddre_by_hand.step(false, sensor, flight.y[k]);
      rule_by_hand.step(true, sensor, flight.y[k]);
      EXPECT_LT(jml::SO3::minus(sddre.x(), sddre_by_hand.x).norm(), 1e-9) << i << ' ' << k;
      EXPECT_LT(jml::SO3::minus(rule.x(), rule_by_hand.x).norm(), 1e-9) << i << ' ' << k;
      EXPECT_LT((sddre.P() - sddre_by_hand.P).norm(), 1e-10);
      EXPECT_LT((rule.P() - rule_by_hand.P).norm(), 1e-10);
    }
    auto exact = filter_of(jml::Iterated<jml::Ekf<>>{}, flight);
    auto exact_jml = filter_of(jml::IteratedJml{}, flight);
    ASSERT_TRUE(jml::usable(exact.step(sensors[0], flight.y[0]).status));
    ASSERT_TRUE(jml::usable(exact_jml.step(sensors[0], flight.y[0]).status));
    EXPECT_LT(jml::SO3::minus(exact.x(), exact_jml.x()).norm(), 1e-9);
  }
}

}  // namespace
