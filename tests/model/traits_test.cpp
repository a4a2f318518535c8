// SPDX-License-Identifier: BSD-3-Clause
// Traits specialised from outside for types that nobody may edit, and hooks found through them.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <jml/model/discretize.hpp>

namespace foreign {

struct Oscillator {
  double stiffness = 2;
};
struct Encoder {};

}  // namespace foreign

template <>
struct jml::DynamicsTraits<foreign::Oscillator> : jml::DynamicsDefaults {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  static jml::Vector<T, 2> dynamics(const foreign::Oscillator& model, const jml::Vector<T, 2>& x) {
    return {x(0) + 0.1 * x(1), x(1) - 0.1 * model.stiffness * x(0)};
  }
  static jml::Matrix<double, 2, 1> disturbance_input(const foreign::Oscillator&) { return {0, 0.1}; }
  static jml::Matrix<double, 1, 1> disturbance_covariance(const foreign::Oscillator&) {
    return jml::Matrix<double, 1, 1>(1.0);
  }
};

template <>
struct jml::SensorTraits<foreign::Encoder> : jml::SensorDefaults {
  static constexpr int measurements = 1;
  template <typename T>
  static jml::Vector<T, 1> measurement(const foreign::Encoder&, const jml::Vector<T, 2>& x) {
    return jml::Vector<T, 1>(x(0));
  }
  static jml::Matrix<double, 1, 1> noise_covariance(const foreign::Encoder&) {
    return jml::Matrix<double, 1, 1>(0.01);
  }
};

namespace {

using namespace jml::operators;

using V1 = jml::Vector<double, 1>;
using M1 = jml::Matrix<double, 1, 1>;

TEST(Traits, SpecialisedFromOutside) {
  jml::Filter filter{
      jml::Ekf{}, foreign::Oscillator{},
      jml::Estimate{jml::Vector<double, 2>(1, 0), 0.5 * jml::Matrix<double, 2, 2>::Identity()}};
  ASSERT_EQ(filter.step(foreign::Encoder{}, 1.0).status, jml::Status::ok);
  // By hand: F = [1 .1; -.2 1], N = F P Fᵀ + diag(0, .01), K = N e_1 / (N_11 + .01), x⁺ = F x + K (1 - 1).
  const double n11 = 0.5 * (1 + 0.01), n21 = 0.5 * (-0.2 + 0.1);
  EXPECT_DOUBLE_EQ(filter.x()(0), 1);
  EXPECT_DOUBLE_EQ(filter.x()(1), -0.2);
  EXPECT_NEAR(filter.P()(0, 0), n11 - n11 * n11 / (n11 + 0.01), 1e-15);
  EXPECT_NEAR(filter.P()(1, 0), n21 - n11 * n21 / (n11 + 0.01), 1e-15);
}

/// A random walk whose Q is found although the struct does not count its disturbances.
struct Walk {
  static constexpr int states = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<float, 1, 1> disturbance_covariance(const jml::Vector<float, 1>&,
                                                  const jml::StepContext<float>&) const {
    return jml::Matrix<float, 1, 1>(5.0F);
  }
};

TEST(Traits, DisturbancesAreCountedWhereACovarianceIsGiven) {
  EXPECT_EQ(jml::DynamicsTraits<Walk>::disturbances, 1);
  const jml::Estimate<float, 1> start{jml::Vector<float, 1>(0.0F), jml::Matrix<float, 1, 1>(1.0F)};
  EXPECT_EQ(jml::predict(jml::Ekf{}, Walk{}, start, jml::StepContext<float>{}).estimate.P(0, 0), 6.0F);
}

/// y = x + u: a sensor that reads the control sees that of the last step in update(), too.
struct Still {
  static constexpr int states = 1, controls = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At&) const {
    return x;
  }
};
struct Feedthrough {
  static constexpr int measurements = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + at.control(0));
  }
  M1 noise_covariance() const { return M1(1.0); }
};

TEST(Traits, ASensorSeesTheControlOfItsStep) {
  const jml::Estimate<double, 1> start{V1(0.0), M1(1.0)};
  jml::Filter together{jml::Ekf{}, Still{}, start}, apart = together;
  ASSERT_EQ(together.step(Feedthrough{}, 3.0, 1.0, V1(2.0)).status, jml::Status::ok);
  ASSERT_EQ(apart.predict(1.0, V1(2.0)), jml::Status::ok);
  ASSERT_EQ(apart.update(Feedthrough{}, 3.0).status, jml::Status::ok);
  EXPECT_DOUBLE_EQ(together.x()(0), 0.5);  // gain 1/2 on 3 - (0 + 2)
  EXPECT_DOUBLE_EQ(apart.x()(0), 0.5);
}

/// ẋ = -a x + w̄ + w: stiff, with a known disturbance.
struct Decay {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  double a = 2, mean = 5;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(-a * x(0));
  }
  M1 disturbance_spectral_density() const { return M1(3.0); }
  V1 disturbance_mean() const { return V1(mean); }
};

TEST(Discretize, KeepsTheDisturbanceMean) {
  const auto step = jml::discretize<jml::RungeKutta4>(Decay{});
  const jml::StepContext<double> at{0, 0.1, {}};
  EXPECT_NEAR(jml::predicted_state(step, V1(0.0), at)(0), 2.5 * (1 - std::exp(-0.2)), 1e-5);
}

// ∫ e^{-2 a s} Q ds = Q (1 - e^{-2 a dt}) / (2 a), also where e^{a dt} would lose every digit.
TEST(Discretize, VanLoanOfAStiffModel) {
  for (const double a : {2.0, 200.0, 5000.0}) {
    const auto step = jml::discretize<jml::RungeKutta4>(Decay{.a = a});
    const double expected = 3 * (1 - std::exp(-2 * a * 0.1)) / (2 * a);
    EXPECT_NEAR(jml::disturbance_covariance(step, V1(0.0), jml::StepContext<double>{0, 0.1, {}})(0, 0), expected,
                1e-12 * expected)
        << a;
  }
}

// Only an unused component of f is a NaN, and the gate rejects: still no NaN becomes the estimate.
struct HalfDefined {
  static constexpr int states = 2;
  jml::Vector<double, 2> dynamics(const jml::Vector<double, 2>& x) const { return {x(0), 0.0 / 0.0}; }
  jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>&) const {
    return jml::Matrix<double, 2, 2>::Identity();
  }
};
struct First {
  static constexpr int measurements = 1;
  template <typename T>
  V1 measurement(const jml::Vector<T, 2>& x) const {
    return V1(x(0));
  }
  jml::Matrix<double, 1, 2> measurement_jacobian(const jml::Vector<double, 2>&) const { return {1, 0}; }
  M1 noise_covariance() const { return M1(1.0); }
};

TEST(Refusal, OfANanThatNobodyLooksAt) {
  const jml::Estimate<double, 2> start{jml::Vector<double, 2>(1, 2),
                                       0.01 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Filter filter{jml::Ekf{}, HalfDefined{}, start};
  for (const double probability : {0.99, 1.0}) {
    filter.gate = {probability};
    EXPECT_EQ(filter.step(First{}, 100.0).status, jml::Status::dynamics_not_finite);
    EXPECT_EQ(filter.x(), start.x);
  }
}

}  // namespace
