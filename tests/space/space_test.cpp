// SPDX-License-Identifier: BSD-3-Clause
// The spaces themselves: plus and minus undo each other up to half a turn, in double and in float; they are
// what closed forms in long double say; and so are their first and second derivatives, at zero too.
#include <gtest/gtest.h>

#include <random>

#include "models/foreign_rotation.hpp"

namespace {

using jml::detail::cast_to;
using Real = long double;
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
constexpr double pi = 3.14159265358979323846;
/// An angle and a length, of which the struct itself says how they move.
struct OwnPlane {
  static constexpr int states = 2, tangent = 2;
  template <typename T>
  static jml::Vector<T, 2> plus(const jml::Vector<T, 2>& x, const jml::Vector<T, 2>& delta) {
    using std::exp;
    return {jml::SO2::plus(jml::Vector<T, 1>(x(0)), jml::Vector<T, 1>(delta(0)))(0), x(1) * exp(delta(1))};
  }
  template <typename T>
  static jml::Vector<T, 2> minus(const jml::Vector<T, 2>& a, const jml::Vector<T, 2>& b) {
    using std::log;
    return {jml::SO2::minus(jml::Vector<T, 1>(a(0)), jml::Vector<T, 1>(b(0)))(0), log(a(1) / b(1))};
  }
  static bool contains(const auto& x) { return x(1) > 0; }
  template <typename T>
  static jml::Vector<T, 2> origin() {
    return {T(0), T(1)};
  }
};
using Own = jml::SpaceOf<OwnPlane>;
using Mixed = jml::Product<jml::SO3, jml::Euclidean<2>, jml::S2, jml::SO2>;
using WithForeign = jml::Product<jml::Euclidean<1>, foreign::Rotations>;
template <typename Space>
using Traits = jml::detail::WholeSpace<Space>;

template <int n, typename T = double>
jml::Vector<T, n> random_vector(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  jml::Vector<T, n> out;
  for (int i = 0; i < n; ++i) out(i) = static_cast<T>(normal(random));
  return out;
}
/// A random state, made without plus(): numbers brought to the space by what it is.
template <typename Space, typename T>
jml::Vector<T, Traits<Space>::numbers> random_state(std::mt19937_64& random) {
  jml::Vector<T, Traits<Space>::numbers> x = random_vector<Traits<Space>::numbers, T>(random);
  if constexpr (std::is_same_v<Space, jml::SO2>) {
    x(0) = T(pi * std::sin(x(0)));
  } else if constexpr (std::is_same_v<Space, Own>) {
    x = {T(std::sin(x(0))), std::exp(x(1))};
  } else if constexpr (std::is_same_v<Space, jml::SO3Matrix>) {
    const Eigen::Quaternion<T> q(random_state<jml::SO3, T>(random));
    Eigen::Map<jml::Matrix<T, 3, 3>>(x.data()) = q.toRotationMatrix();
  } else if constexpr (std::is_same_v<Space, Mixed>) {
    x.template head<4>().normalize();
    x.template segment<3>(6).normalize();
    x(9) = T(std::sin(x(9)));
  } else if constexpr (std::is_same_v<Space, WithForeign>) {
    x.template tail<4>().normalize();
  } else if constexpr (!std::is_same_v<Space, jml::Euclidean<3>>) {
    x.normalize();
  }
  return x;
}

template <typename Space, typename T>
void expect_round_trips() {
  using Of = Traits<Space>;
  constexpr T epsilon = std::numeric_limits<T>::epsilon();
  std::mt19937_64 random(1);
  for (const double size : {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.0316, 0.0317, 0.1, 0.11, 1.0, 2.0, 3.0, 3.1}) {
    for (int i = 0; i < 100; ++i) {
      const auto x = random_state<Space, T>(random), y = random_state<Space, T>(random);
      auto d = random_vector<Of::tangent, T>(random);
      d = T(size) * (d / d.norm()).eval();
      const auto moved = Of::plus(x, d);
      EXPECT_TRUE(Of::contains(x));
      EXPECT_TRUE(Of::contains(moved));
      // Near half a turn what is across it is known to a share of the sine.
      const T slack = 32 * epsilon * (1 + T(size)) / (size > 2 ? std::sin(T(size)) : T(1));
      EXPECT_LT((Of::minus(moved, x) - d).norm(), slack * (1 + x.cwiseAbs().maxCoeff())) << size;
      const auto there = Of::plus(x, Of::minus(y, x));
      // As states: a quaternion and its negative are one.
      EXPECT_LT(Of::minus(there, y).norm(), 64 * epsilon * (1 + x.norm() + y.norm()));
    }
  }
  // At the origin no digit is lost by the state's own: the error is a share of δ.
  if constexpr (!std::is_same_v<Space, WithForeign> && requires { Space::template origin<T>(); }) {
    const auto x = Of::template origin<T>();
    for (const double size : {1e-12, 1e-8, 1e-4, 0.0316, 0.0317, 0.1, 1.0}) {
      auto d = random_vector<Of::tangent, T>(random);
      d = T(size) * (d / d.norm()).eval();
      const T share = std::is_same_v<Space, Own> ? 2 * epsilon / T(size) : 16 * epsilon;
      EXPECT_LT((Of::minus(Of::plus(x, d), x) - d).norm(), share * T(size)) << size;
    }
  }
}
template <typename>
struct EverySpace : testing::Test {};
using Spaces = testing::Types<jml::Euclidean<3>, jml::SO2, jml::SO3, jml::SO3Matrix, jml::S2, Own, Mixed,
                              foreign::Rotations, WithForeign>;
TYPED_TEST_SUITE(EverySpace, Spaces);
TYPED_TEST(EverySpace, PlusAndMinusUndoEachOther) { expect_round_trips<TypeParam, double>(); }
TYPED_TEST(EverySpace, SoInFloat) { expect_round_trips<TypeParam, float>(); }

Matrix3 cross(const Vector3& v) {
  Matrix3 out;
  out << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
  return out;
}
/// A(θ) of exp and of its right Jacobian, by series where they are 0/0.
Real sine_share(Real angle) { return angle < 1e-3L ? 1 - angle * angle / 6 : std::sin(angle) / angle; }
Real cosine_share(Real angle) {
  return 0.5L * sine_share(angle / 2) * sine_share(angle / 2);  // (1 - cos θ) / θ²
}
Real third_share(Real angle) {
  return angle < 1e-3L ? 1 / 6.0L - angle * angle / 120 : (angle - std::sin(angle)) / (angle * angle * angle);
}
Matrix3 rodrigues(const Vector3& v) {
  const Matrix3 K = cross(v);
  return Matrix3::Identity() + sine_share(v.norm()) * K + cosine_share(v.norm()) * K * K;
}
Matrix3 right_jacobian(const Vector3& v) {
  const Matrix3 K = cross(v);
  return Matrix3::Identity() - cosine_share(v.norm()) * K + third_share(v.norm()) * K * K;
}
const double sizes[] = {1e-12, 1e-9, 1e-6, 1e-4, 0.0316, 0.0317, 0.0999, 0.1001, 0.5, 1.5, 2.5, 3.1, 4.5};

// R(x ⊞ δ) = R(x) Rodrigues(δ), the quaternion has length 1 to rounding, and -q is q.
TEST(Rotations, MoveAsRodriguesSays) {
  std::mt19937_64 random(2);
  for (const double size : sizes) {
    const auto q = random_state<jml::SO3, double>(random);
    const jml::Vector<double, 3> d = size * random_vector<3>(random).normalized();
    const Eigen::Quaternion<Real> exact(Real(q(0)), Real(q(1)), Real(q(2)), Real(q(3)));
    const Matrix3 before = exact.normalized().toRotationMatrix(), after = before * rodrigues(d.cast<Real>());
    const jml::Vector<double, 4> moved = jml::SO3::plus(q, d);
    EXPECT_NEAR(moved.norm(), 1, 3e-16);
    const Eigen::Quaternion<Real> m(Real(moved(0)), Real(moved(1)), Real(moved(2)), Real(moved(3)));
    EXPECT_LT((m.toRotationMatrix() - after).cwiseAbs().maxCoeff(), 2e-15L) << size;
    jml::Vector<double, 9> R;
    for (int i = 0; i < 9; ++i) R(i) = static_cast<double>(before.data()[i]);
    const jml::Vector<double, 9> turned = jml::SO3Matrix::plus(R, d);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(turned(i), static_cast<double>(after.data()[i]), 2e-15) << size;
    const jml::Vector<double, 4> other = -q;
    EXPECT_EQ(jml::SO3::minus(moved, q), jml::SO3::minus(moved, other));
    EXPECT_LT((jml::rotate(q, d) - (before * d.cast<Real>()).cast<double>()).norm(), 1e-15 * (1 + size));
    EXPECT_LT((jml::rotate_back(q, d) - (before.transpose() * d.cast<Real>()).cast<double>()).norm(),
              1e-15 * (1 + size));
  }
}
// The slope of a chart is the right Jacobian of SO(3), of every way to write a rotation.
template <typename Space>
void expect_right_jacobian() {
  std::mt19937_64 random(3);
  for (const double size : sizes) {
    for (int i = 0; i < 20; ++i) {
      const auto x = random_state<Space, double>(random);
      const jml::Vector<double, 3> z = size * random_vector<3>(random).normalized();
      const auto J = jml::detail::WholeSpace<Space>::chart_slope(x, z);
      EXPECT_LT((J - right_jacobian(z.cast<Real>()).cast<double>()).norm(), 1e-14) << size;
    }
  }
}
TEST(Rotations, TheirChartHasTheRightJacobian) {
  expect_right_jacobian<jml::SO3>();
  expect_right_jacobian<jml::SO3Matrix>();
  expect_right_jacobian<foreign::Rotations>();
}
// The other way: the slope of minus(plus(x, v) u-wards, y) is J_r⁻¹ of what it says.
TEST(Rotations, TheLogarithmHasTheInverse) {
  std::mt19937_64 random(4);
  const jml::Vector<double, 3> zero = jml::Vector<double, 3>::Zero();
  for (const double size : sizes) {
    if (size > 3.2) continue;
    const auto y = random_state<jml::SO3, double>(random);
    const jml::Vector<double, 3> z = size * random_vector<3>(random).normalized();
    const auto x = jml::SO3::plus(y, z);
    const auto slope = jml::derive_jacobian<3>(
        [&](const auto& d) {
          using T = typename std::remove_cvref_t<decltype(d)>::Scalar;
          return jml::SO3::minus(jml::SO3::plus(cast_to<T>(x), d), cast_to<T>(y));
        },
        zero);
    const auto product = slope * right_jacobian(z.cast<Real>()).cast<double>();
    EXPECT_LT((product - jml::Matrix<double, 3, 3>::Identity()).norm(), 2e-14 / std::sin(size / 2 + 0.01));
  }
}

/// Second derivatives at zero of log(exp(-v) exp(u)) = u - v - ½ v × u + … of third order.
template <typename Space>
void expect_curvature() {
  std::mt19937_64 random(5);
  using Of = Traits<Space>;
  using Two = jml::Dual<jml::Dual<double, 6>, 6>;
  const auto base = cast_to<Two>(random_state<Space, double>(random));
  const auto both = jml::seed(jml::seed(jml::Vector<double, 6>(jml::Vector<double, 6>::Zero())));
  const jml::Vector<Two, 3> u = both.head<3>(), v = both.tail<3>();
  const auto out = Of::minus(Of::plus(base, u), Of::plus(base, v));
  const auto epsilon = [](int i, int j, int k) { return (i - j) * (j - k) * (k - i) / 2.0; };
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(out(k).value.partial[i], i == k ? 1 : (i == k + 3 ? -1 : 0), 1e-14);
      for (int j = 0; j < 6; ++j) {
        double expected = 0;
        if (i < 3 && j >= 3) expected = -epsilon(j - 3, i, k) / 2;
        if (i >= 3 && j < 3) expected = -epsilon(i - 3, j, k) / 2;
        EXPECT_NEAR(out(k).partial[i].partial[j], expected, 1e-14) << k << i << j;
      }
    }
  }
}
TEST(Rotations, SecondDerivativesAtZero) {
  expect_curvature<jml::SO3>();
  expect_curvature<jml::SO3Matrix>();
  expect_curvature<foreign::Rotations>();
}

// A direction moves along great circles, by |δ|, and as δ turns so does the way: (∂x)ᵀ ∂x = I, ∂²x = -x I.
TEST(Directions, MoveAlongGreatCircles) {
  std::mt19937_64 random(6);
  using Two = jml::Dual<jml::Dual<double, 2>, 2>;
  for (int i = 0; i < 200; ++i) {
    auto x = random_state<jml::S2, double>(random);
    if (i < 4) x = {0, 0, i % 2 == 0 ? 1.0 : -1.0};
    if (i == 5) x = jml::Vector<double, 3>(1, 0, 0);
    const double size = sizes[i % 12];
    const jml::Vector<double, 2> d = size * random_vector<2>(random).normalized();
    const auto moved = jml::S2::plus(x, d);
    EXPECT_NEAR(std::atan2(x.cross(moved).norm(), x.dot(moved)), size, 1e-15 * (1 + size));
    const auto u = jml::seed(jml::seed(jml::Vector<double, 2>(0, 0)));
    const auto out = jml::S2::plus(cast_to<Two>(x), u);
    jml::Matrix<double, 3, 2> E;
    for (int k = 0; k < 3; ++k) {
      for (int a = 0; a < 2; ++a) {
        E(k, a) = out(k).value.partial[a];
        for (int b = 0; b < 2; ++b) EXPECT_NEAR(out(k).partial[a].partial[b], a == b ? -x(k) : 0, 1e-14);
      }
    }
    EXPECT_LT((E.transpose() * E - jml::Matrix<double, 2, 2>::Identity()).norm(), 1e-14);
    EXPECT_LT((E.transpose() * x).norm(), 1e-15);
    const jml::Vector<double, 3> expected = std::cos(size) * x + std::sin(size) / size * (E * d);
    EXPECT_LT((moved - expected).norm(), 2e-15 * (1 + size));
    // The antipode is half a turn away, whichever way.
    const jml::Vector<double, 3> opposite = -x;
    const auto half = jml::S2::minus(opposite, x);
    EXPECT_NEAR(half.norm(), pi, 1e-7);
    EXPECT_LT((jml::S2::plus(x, half) - opposite).norm(), 1e-7);
  }
}

TEST(Angles, StayWithinATurn) {
  using One = jml::Vector<double, 1>;
  for (int i = -50; i <= 50; ++i) {
    const double angle = 0.37 * i;
    const double kept = jml::SO2::plus(One(0.0), One(angle))(0);
    EXPECT_LE(std::abs(kept), pi);
    EXPECT_NEAR(std::remainder(angle, 2 * pi), kept, 1e-14);
  }
  EXPECT_NEAR(jml::SO2::minus(One(3.1), One(-3.1))(0), 6.2 - 2 * pi, 1e-15);
}

template <typename Space, typename T = double>
bool contains(std::initializer_list<double> numbers) {
  jml::Vector<T, Traits<Space>::numbers> x;
  int i = 0;
  for (const double number : numbers) x(i++) = static_cast<T>(number);
  return Traits<Space>::contains(x);
}
TEST(Spaces, KnowWhatIsInThem) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(contains<jml::SO3>({0.6, 0, -0.8, 0}) && contains<jml::SO3>({-1, 0, 0, 0}));
  EXPECT_TRUE(contains<jml::SO3>({1 + 1e-9, 0, 0, 0}) && (contains<jml::SO3, float>({1 + 1e-5, 0, 0, 0})));
  EXPECT_FALSE(contains<jml::SO3>({1.1, 0, 0, 0}) || contains<jml::SO3>({1 + 1e-7, 0, 0, 0}));
  EXPECT_FALSE(contains<jml::SO3>({0, 0, 0, 0}) || contains<jml::SO3>({nan, 0, 0, 0}));
  EXPECT_TRUE(contains<jml::SO3Matrix>({0, 1, 0, -1, 0, 0, 0, 0, 1}));
  EXPECT_FALSE(contains<jml::SO3Matrix>({1, 0, 0, 0, 1, 0, 0, 0, -1}));  // a reflection
  EXPECT_FALSE(contains<jml::SO3Matrix>({1, 0, 0, 0, 1, 0, 0, 0.1, 1}));
  EXPECT_FALSE(contains<jml::SO3Matrix>({1, 0, 0, 0, nan, 0, 0, 0, 1}));
  EXPECT_FALSE(contains<jml::SO3Matrix>({1, 0, 0, 0, 1, nan, 0, 0, 1}));
  EXPECT_TRUE(contains<jml::S2>({0, 0.6, 0.8}));
  EXPECT_FALSE(contains<jml::S2>({0, 0.6, 0.6}) || contains<jml::S2>({nan, 0, 1}));
  EXPECT_TRUE(contains<Own>({9, 1}) && contains<jml::Euclidean<1>>({9}) && contains<jml::SO2>({9}));
  EXPECT_FALSE(contains<Own>({9, -1}));
  EXPECT_TRUE(contains<Mixed>({1, 0, 0, 0, 7, 8, 0, 1, 0, 9}));
  EXPECT_FALSE(contains<Mixed>({1, 0, 0, 0, 7, 8, 0, 1.1, 0, 9}));
  EXPECT_FALSE(contains<Mixed>({1, 0.1, 0, 0, 7, 8, 0, 1, 0, 9}));
  EXPECT_EQ(Mixed::origin<double>(), (jml::Vector<double, 10>() << 1, 0, 0, 0, 0, 0, 0, 0, 1, 0).finished());
  EXPECT_EQ(Own::origin<double>(), (jml::Vector<double, 2>(0, 1)));
  static_assert(Mixed::numbers == 10 && Mixed::tangent == 8 && jml::degrees_of<OwnPlane> == 2);
}

}  // namespace
