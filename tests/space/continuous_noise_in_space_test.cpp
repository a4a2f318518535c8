// SPDX-License-Identifier: BSD-3-Clause
// The continuous EKF over states in a space: closed forms of attitudes and directions, a space that is no
// group, and the ways in which a model may give its noise and its derivatives.
#include <gtest/gtest.h>

#include <jml/continuous/continuous.hpp>
#include <jml/model/rotation.hpp>
#include <jml/model/sphere.hpp>

#include "space/gyro_attitude.hpp"

namespace {

using gyro_attitude::cross, gyro_attitude::exponential, gyro_attitude::Matrix3, gyro_attitude::rotation,
    gyro_attitude::Vector3, gyro_attitude::Vector4;
constexpr double q = 0.003;

/// q̇ = ½ q ∘ (0, ω) at a constant rate, and its noise: added, as an argument, or as a mean beside it.
struct Turning {
  using Space = jml::SO3;
  using time_domain = jml::ContinuousTime;
  static constexpr int disturbances = 3;
  Matrix3 disturbance_spectral_density() const { return q * Matrix3::Identity(); }
};
const Vector3 rate{0.7, -0.4, 1.1};
struct Added : Turning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&) const {
    return rate.cast<T>();
  }
};
struct Argument : Turning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&, const jml::Vector<T, 3>& w) const {
    return rate.cast<T>() + w;
  }
};
struct Mean : Turning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&) const {
    return (0.5 * rate).cast<T>();
  }
  Vector3 disturbance_mean() const { return 0.5 * rate; }
};

template <typename D>
auto turned(const D& model, int steps, double span) {
  Matrix3 P;
  P << 0.04, 0.01, 0, 0.01, 0.09, -0.02, 0, -0.02, 0.01;
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, model, jml::Estimate{Vector4(0.1, 0.7, -0.5, 0.5), P}};
  for (int k = 0; k < steps; ++k) EXPECT_EQ(filter.predict(span / steps), jml::Status::ok);
  return filter;
}

TEST(ContinuousNoiseInSpace, AConstantRateIsAClosedForm) {
  const Matrix3 turn = exponential(-rate * 1.5), P = turned(Added{}, 0, 1).P(),
                identity = Matrix3::Identity();
  const Matrix3 right = turn * P * turn.transpose() + 1.5 * q * identity;
  double error[2];
  for (int i = 0; i < 2; ++i) {
    const auto filter = turned(Added{}, 4 << i, 1.5);
    // z = ω t on the way: exact. P turns with the body, and what an isotropic noise adds does not show it.
    EXPECT_LT((rotation(filter.x()) - rotation(Vector4(0.1, 0.7, -0.5, 0.5)) * turn.transpose()).norm(),
              4e-15);
    error[i] = (filter.P() - right).norm();
  }
  EXPECT_LT(error[0], 1e-4);
  EXPECT_NEAR(std::log2(error[0] / error[1]), 4, 0.2);
}

/// The body's z axis goes round a cone: q(t) = (cos ½θ, sin ½θ (cos Ωt, sin Ωt, 0)).
constexpr double tilt = 0.3, omega = 2;
Vector4 coning(double t) {
  return {std::cos(tilt / 2), std::sin(tilt / 2) * std::cos(omega * t),
          std::sin(tilt / 2) * std::sin(omega * t), 0};
}
struct Coning : Turning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&, const auto& at) const {
    const double phase = omega * at.time, across = omega * std::sin(tilt), half = std::sin(tilt / 2);
    return Vector3(-across * std::sin(phase), across * std::cos(phase), -2 * omega * half * half).cast<T>();
  }
};
TEST(ContinuousNoiseInSpace, ConingIsAClosedForm) {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    const int steps = 30 << i;
    const Matrix3 P = 0.01 * Matrix3::Identity();
    jml::Filter filter{jml::Continuous{jml::Ekf{}}, Coning{}, jml::Estimate{coning(0), P}};
    for (int k = 0; k < steps; ++k) ASSERT_EQ(filter.predict(3.0 / steps), jml::Status::ok);
    EXPECT_NEAR(filter.x().norm(), 1, 1e-15);
    EXPECT_LT((filter.P() - (0.01 + 3 * q) * Matrix3::Identity()).norm(), 1e-6);
    error[i] = jml::SO3::minus(filter.x(), coning(3)).norm();
  }
  EXPECT_LT(error[0], 1e-5);
  EXPECT_NEAR(std::log2(error[0] / error[1]), 4, 0.2);
}

TEST(ContinuousNoiseInSpace, OneModelGivenInThreeWaysIsOneFilter) {
  const auto added = turned(Added{}, 3, 1);
  const auto argument = turned(Argument{}, 3, 1);
  const auto mean = turned(Mean{}, 3, 1);
  EXPECT_LT((added.x() - argument.x()).norm() + (added.P() - argument.P()).norm(), 1e-15);
  EXPECT_LT((added.x() - mean.x()).norm() + (added.P() - mean.P()).norm(), 1e-15);
}

/// Towards a direction: ξ depends on x, and f_x is known: that of c Rᵀ d × e in the tangent.
struct Seeking : Turning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>& x) const {
    const jml::Vector<T, 3> d = jml::rotate_back(x, jml::Vector<T, 3>(gyro_attitude::direction.cast<T>()));
    return jml::Vector<T, 3>(T(0.4) - d(1), d(0), T(0.5));  // e_z × d, and a turn
  }
};
struct SeekingBySelf : Seeking {
  Matrix3 dynamics_jacobian(const Vector4& x) const {
    const Vector3 d = rotation(x).transpose() * gyro_attitude::direction;
    return cross(Vector3(0, 0, 1)) * cross(d);
  }
};
TEST(ContinuousNoiseInSpace, AJacobianOfOnesOwnIsThatOfTheTangent) {
  const auto derived = turned(Seeking{}, 10, 1);
  const auto given = turned(SeekingBySelf{}, 10, 1);
  EXPECT_LT((derived.x() - given.x()).norm(), 1e-15);
  EXPECT_LT((derived.P() - given.P()).norm(), 1e-15);
  EXPECT_GT((derived.P() - turned(Added{}, 10, 1).P()).norm(), 1e-3);
}

/// A direction s that turns, ṡ = -ω × s, over the equator, in two coordinates of which nothing is known.
const Vector3 across{1.1, 0.7, -0.4};
struct Direction {
  using Space = jml::S2;
  using time_domain = jml::ContinuousTime;
  static constexpr int disturbances = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 3>& s) const {
    using Along = jml::Dual<T, 1>;
    jml::Vector<Along, 3> here, ahead;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      here(i) = ahead(i) = s(i);
      ahead(i).partial[0] = across(k) * s(j) - across(j) * s(k);
    }
    const jml::Vector<Along, 2> off = jml::S2::minus(ahead, here);
    return jml::Vector<T, 2>(off(0).partial[0], off(1).partial[0]);
  }
  jml::Matrix<double, 2, 2> disturbance_spectral_density() const {
    return q * jml::Matrix<double, 2, 2>::Identity();
  }
};
struct SeenAlways {
  static constexpr int measurements = 3;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 3>& s) const {
    return s;
  }
  Matrix3 noise_spectral_density() const { return 0.02 * Matrix3::Identity(); }
};
/// Of the tangent as vectors of ℝ³, 3×2.
jml::Matrix<double, 3, 2> axes(const Vector3& s) {
  const auto moved = jml::S2::plus(jml::Vector<jml::Dual<double, 2>, 3>(s.cast<jml::Dual<double, 2>>()),
                                   jml::seed(jml::Vector<double, 2>(0, 0)));
  jml::Matrix<double, 3, 2> out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 2; ++j) out(i, j) = moved(i).partial[j];
  }
  return out;
}
const Vector3 first{0.48, -0.6, 0.64};
auto looking() {
  const jml::Matrix<double, 2, 2> P{{0.05, 0.02}, {0.02, 0.03}};
  return jml::Filter{jml::Continuous{jml::Ekf{}}, Direction{}, jml::Estimate{first, P}};
}
Matrix3 embedded(const auto& filter) {
  const jml::Matrix<double, 3, 2> B = axes(filter.x());
  return B * filter.P() * B.transpose();
}

TEST(ContinuousNoiseInSpace, ADirectionTurnsAsAVectorAcrossTheEquatorToo) {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    auto filter = looking();
    const Matrix3 before = embedded(filter), turn = exponential(-across * 2);
    const int steps = 20 << i;
    for (int k = 0; k < steps; ++k) ASSERT_EQ(filter.predict(2.0 / steps), jml::Status::ok);
    const Vector3 s = turn * first;
    EXPECT_LT(s(2) * first(2), 0);
    const Matrix3 right =
        turn * before * turn.transpose() + 2 * q * (Matrix3::Identity() - s * s.transpose());
    EXPECT_NEAR(filter.x().norm(), 1, 1e-15);
    error[i] = (embedded(filter) - right).norm() + (filter.x() - s).norm();
  }
  EXPECT_LT(error[0], 1e-5);
  EXPECT_NEAR(std::log2(error[0] / error[1]), 4, 0.3);
}

// In ℝ³: C = B P Bᵀ is carried along the flow by -ω ×, and along the push v = C ν / r of the measurement as a
// tangent vector is moved in parallel, ḃ = -s (v·b).
TEST(ContinuousNoiseInSpace, APushOfTheMeasurementCarriesPInParallel) {
  const auto y = [](double t) { return Vector3(std::cos(t), 0.9, 0.3 * t); };
  auto reference = looking();
  Vector3 s = first;
  Matrix3 C = embedded(reference);
  const auto slope = [&](double t, const Vector3& at_s, const Matrix3& at_C, Vector3& ds, Matrix3& dC) {
    const Vector3 v = at_C * (y(t) - at_s) / 0.02;
    ds = -cross(across) * at_s + v;
    const Matrix3 A = -cross(across) - at_s * v.transpose();
    dC = A * at_C + at_C * A.transpose() - at_C * at_C / 0.02 +
         q * (Matrix3::Identity() - at_s * at_s.transpose() / at_s.squaredNorm());
  };
  const int fine = 4000;
  const double h = 1.0 / fine;
  for (int k = 0; k < fine; ++k) {
    Vector3 a, b, c, d;
    Matrix3 A, B, G, E;
    slope(k * h, s, C, a, A);
    slope((k + 0.5) * h, s + h / 2 * a, C + h / 2 * A, b, B);
    slope((k + 0.5) * h, s + h / 2 * b, C + h / 2 * B, c, G);
    slope((k + 1) * h, s + h * c, C + h * G, d, E);
    s += h / 6 * (a + 2 * b + 2 * c + d);
    C += h / 6 * (A + 2 * B + 2 * G + E);
    s.normalize();
  }
  double error[2];
  for (int i = 0; i < 2; ++i) {
    auto filter = looking();
    const int steps = 40 << i;
    for (int k = 0; k < steps; ++k)
      ASSERT_EQ(filter.step(SeenAlways{}, y, 1.0 / steps).status, jml::Status::ok);
    error[i] = (embedded(filter) - C).norm() / C.norm() + (filter.x() - s).norm();
  }
  EXPECT_LT(error[1], 1e-6);
  EXPECT_NEAR(std::log2(error[0] / error[1]), 4, 0.4);
}

}  // namespace
