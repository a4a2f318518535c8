// SPDX-License-Identifier: BSD-3-Clause
// check_model is silent on sound models and names each of twelve planted mistakes.
#include <gtest/gtest.h>

#include <jml/model/check.hpp>
#include <jml/model/discretize.hpp>
#include <string>

#include "models/linear.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using Function = jml::Finding::Function;
using Fault = jml::Finding::Fault;

const jml::Vector<double, 2> x(1.3, -0.7);

/// Van der Pol with one mistake, by number.
template <int mistake>
struct WrongDynamics {
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = mistake == 9;
  models::VanDerPol sound{};

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& z) const {
    jml::Vector<T, 2> f = sound.dynamics(z);
    if (mistake == 7) f(1) = f(1) / T(0);
    return f;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& z) const {
    jml::Matrix<T, 2, 2> J = sound.dynamics_jacobian(z);
    if (mistake == 1) J(1, 0) = -J(1, 0);
    if (mistake == 2) J.transposeInPlace();
    if (mistake == 3) J(1, 1) += T(1e-4);
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& z) const {
    jml::Matrix<T, 2, 2> F = sound.dynamics_sdc(z);
    if (mistake == 4) F = sound.dynamics_jacobian(z);  // the favourite: a Jacobian is not a SDC
    if (mistake == 5) F(0, 1) = T(0);
    return F;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const {
    return mistake == 8 ? jml::Matrix<double, 2, 1>(0, 0.0 / 0.0) : sound.disturbance_input();
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const {
    return jml::Matrix<double, 1, 1>(mistake == 6 ? -1.0 : 1.0);
  }
};

template <int mistake>
struct WrongSensor {
  static constexpr int measurements = 1;
  models::SaturatingPosition sound{};
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& z) const {
    return sound.measurement(z);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& z) const {
    jml::Matrix<T, 1, 2> J = sound.measurement_jacobian(z);
    if (mistake == 1) J = sound.measurement_sdc(z);  // M in the place of m_x
    return J;
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& z) const {
    jml::Matrix<T, 1, 2> M = sound.measurement_sdc(z);
    if (mistake == 2) M = sound.measurement_jacobian(z);
    return M;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const {
    return jml::Matrix<double, 1, 1>(mistake == 3 ? 0.0 : 1e-2);
  }
};

void expect_only(const jml::ModelReport& report, Function function, Fault fault, int row, int column) {
  EXPECT_TRUE(report.has(function, fault));
  for (int i = 0; i < report.count; ++i) {
    const auto& finding = report.findings[static_cast<std::size_t>(i)];
    EXPECT_EQ(finding.function, function);
    if (finding.fault == fault && row >= 0) {
      EXPECT_EQ(finding.row, row);
      EXPECT_EQ(finding.column, column);
    }
  }
}

TEST(CheckModel, IsSilentOnSoundModels) {
  EXPECT_TRUE(jml::check_model(models::VanDerPol{}, x).ok());
  EXPECT_TRUE(jml::check_model(models::SaturatingPosition{}, x).ok());
  jml::Vector<double, 6> target;
  target << 40, 25, 12, -0.4, 0.1, 0.02;
  EXPECT_TRUE(jml::check_model(models::BallisticTarget{}, target).ok());
  EXPECT_TRUE(jml::check_model(models::Radar{}, target).ok());
}

TEST(CheckModel, NamesTwelveMistakes) {
  expect_only(jml::check_model(WrongDynamics<1>{}, x), Function::jacobian, Fault::disagrees_with_duals, 1, 0);
  expect_only(jml::check_model(WrongDynamics<1>{}, x), Function::jacobian, Fault::disagrees_with_differences,
              1, 0);
  expect_only(jml::check_model(WrongDynamics<2>{}, x), Function::jacobian, Fault::disagrees_with_duals, -1,
              -1);
  expect_only(jml::check_model(WrongDynamics<3>{}, x), Function::jacobian, Fault::disagrees_with_duals, 1, 1);
  expect_only(jml::check_model(WrongDynamics<4>{}, x), Function::sdc, Fault::breaks_definition, 1, 0);
  expect_only(jml::check_model(WrongDynamics<5>{}, x), Function::sdc, Fault::breaks_definition, 0, 0);
  expect_only(jml::check_model(WrongDynamics<6>{}, x), Function::covariance, Fault::not_a_covariance, 0, 0);
  expect_only(jml::check_model(WrongDynamics<7>{}, x), Function::dynamics, Fault::not_finite, 1, 0);
  expect_only(jml::check_model(WrongDynamics<8>{}, x), Function::input, Fault::not_finite, 1, 0);
  expect_only(jml::check_model(WrongDynamics<9>{}, x), Function::linear, Fault::not_linear, -1, -1);
  expect_only(jml::check_model(WrongSensor<1>{}, x), Function::jacobian, Fault::disagrees_with_duals, 0, 0);
  expect_only(jml::check_model(WrongSensor<2>{}, x), Function::sdc, Fault::breaks_definition, 0, 0);
  expect_only(jml::check_model(WrongSensor<3>{}, x), Function::covariance, Fault::not_a_covariance, 0, 0);
}

/// y_i = sin(w_i x_i) + x_0 x_i w_0 w_i, with a Jacobian that is `wrong` in entry (i, i) by that factor. Not
/// a template: nothing but differences can check it.
struct Waves {
  static constexpr int measurements = 2;
  jml::Vector<double, 2> w;
  double wrong = 1;
  int entry = 0;
  jml::Vector<double, 2> measurement(const jml::Vector<double, 2>& z) const {
    return {std::sin(w(0) * z(0)), std::sin(w(1) * z(1)) + w(0) * z(0) * w(1) * z(1)};
  }
  jml::Matrix<double, 2, 2> measurement_jacobian(const jml::Vector<double, 2>& z) const {
    const double a = w(0) * z(0), b = w(1) * z(1);
    jml::Matrix<double, 2, 2> J{{w(0) * std::cos(a), 0}, {w(0) * b, w(1) * (std::cos(b) + a)}};
    J(entry, entry) *= wrong;
    return J;
  }
  jml::Matrix<double, 2, 2> measurement_sdc(const jml::Vector<double, 2>& z) const {
    const double a = w(0) * z(0), b = w(1) * z(1);
    return jml::Matrix<double, 2, 2>{{std::sin(a) / z(0), 0}, {0, std::sin(b) / z(1) + a * w(1)}};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return jml::Matrix<double, 2, 2>::Identity(); }
};

/// m = sin(1e9 x), as it is given or with a wrong Jacobian.
struct FineWave {
  static constexpr int measurements = 1;
  double slope = 1e9;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& z) const {
    using std::sin;
    return jml::Vector<T, 1>(sin(1e9 * z(0)));
  }
  jml::Matrix<double, 1, 1> measurement_jacobian(const jml::Vector<double, 1>& z) const {
    return jml::Matrix<double, 1, 1>(slope * std::cos(1e9 * z(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1.0); }
};

TEST(CheckModel, HasNoUnitOfItsOwn) {
  for (const double at : {5e-10, -3e-9, 0.0, 1e-12, 0.7}) {
    const jml::Vector<double, 1> z(at);
    jml::check_model(FineWave{}, z).print([&](const char* line) { ADD_FAILURE() << at << ": " << line; });
    for (const double slope :
         {0.0, 1.0, -1e9, 1.01e9, 1e12}) {  // at 0.7 rounding of 1e9 x leaves four digits
      const auto report = jml::check_model(FineWave{slope}, z);
      EXPECT_TRUE(report.has(Function::jacobian, Fault::disagrees_with_duals)) << at << " " << slope;
      EXPECT_TRUE(report.has(Function::jacobian, Fault::disagrees_with_differences)) << at << " " << slope;
    }
  }
}

// Both states in units of their own between 1e-9 and 1e9: a right Jacobian agrees, one of 1e-3 too much in an
// entry does not, whatever the other entries of its row are.
TEST(CheckModel, FindsAWrongEntryInAnyUnits) {
  jml::Noise noise(3);
  for (int run = 0; run < 300; ++run) {
    jml::Vector<double, 2> w, z;
    for (int i = 0; i < 2; ++i) {
      w(i) = std::pow(10.0, 9 * std::erf(noise.normal()));
      z(i) = (0.2 + std::abs(std::erf(noise.normal()))) * (noise.normal() < 0 ? -1 : 1) / w(i);
    }
    jml::check_model(Waves{w}, z).print([&](const char* line) { ADD_FAILURE() << run << ": " << line; });
    for (int i = 0; i < 2; ++i) {
      for (const double wrong : {0.0, -1.0, 1.001, 1e6}) {
        const auto report = jml::check_model(Waves{w, wrong, i}, z);
        const double slope = std::cos(w(i) * z(i)) + i * w(0) * z(0);
        if (std::abs(slope) < 1e-2) continue;
        expect_only(report, Function::jacobian, Fault::disagrees_with_differences, i, i);
      }
    }
  }
}

// Zeros of the Jacobian: an exact one, one of an even function, one at a triple root, one left by rounding.
struct Zeros {
  static constexpr int measurements = 4;
  double wrong = 0;
  jml::Vector<double, 4> measurement(const jml::Vector<double, 2>& z) const {
    return {z(0), std::cos(z(1)) + z(0), std::pow(z(1), 3), (z(0) + 1e3 * z(1)) - 1e3 * z(1)};
  }
  jml::Matrix<double, 4, 2> measurement_jacobian(const jml::Vector<double, 2>& z) const {
    jml::Matrix<double, 4, 2> J{{1, 1e-17}, {1, -std::sin(z(1))}, {0, 3 * z(1) * z(1)}, {1, 0}};
    J(0, 1) += wrong;
    return J;
  }
  jml::Matrix<double, 4, 2> measurement_sdc(const jml::Vector<double, 2>& z) const {
    const double c = z(1) == 0 ? 0 : (std::cos(z(1)) - 1) / z(1);
    return jml::Matrix<double, 4, 2>{{1, 0}, {1, c}, {0, z(1) * z(1)}, {1, 0}};
  }
  jml::Matrix<double, 4, 4> noise_covariance() const { return jml::Matrix<double, 4, 4>::Identity(); }
};

TEST(CheckModel, TakesRoundingForZero) {
  for (const double at : {0.0, 1e-4, 0.3, 3.0}) {
    const jml::Vector<double, 2> z(0.7, at);
    jml::check_model(Zeros{}, z).print([&](const char* line) { ADD_FAILURE() << at << ": " << line; });
    expect_only(jml::check_model(Zeros{1e-6}, z), Function::jacobian, Fault::disagrees_with_differences, 0,
                1);
  }
}

TEST(CheckModel, PrintsWhereAndWhat) {
  std::string text;
  jml::check_model(WrongDynamics<4>{}, x).print([&](const char* line) { text += line; });
  EXPECT_NE(text.find("SDC matrix does not satisfy"), std::string::npos) << text;
  EXPECT_NE(text.find("entry (1, 0)"), std::string::npos) << text;
}

/// ẋ = A x + w on two axes, for Van Loan's closed form: a double integrator driven by white acceleration.
struct DoubleIntegrator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = true;
  double density = 0.7;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& z) const {
    return {z(1), T(0)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const {
    return jml::Matrix<double, 1, 1>(density);
  }
};

/// Van der Pol in continuous time, eqs. (19)-(22).
struct ContinuousVanDerPol {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  double c = 0.1, k = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& z) const {
    return {z(1), -k * z(0) - 2 * c * (z(0) * z(0) - 1.0) * z(1)};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& z) const {
    jml::Matrix<T, 2, 2> F;
    F << T(0), T(1), T(-k), -2 * c * (z(0) * z(0) - 1.0);
    return F;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }
};

TEST(Discretize, VanLoanOfADoubleIntegrator) {
  const auto step = jml::discretize<jml::RungeKutta4>(DoubleIntegrator{});
  const double h = 0.3, q = 0.7;
  const auto Q = jml::disturbance_covariance(step, x, jml::StepContext<double>{0, h, {}});
  EXPECT_NEAR(Q(0, 0), q * h * h * h / 3, 1e-15);
  EXPECT_NEAR(Q(0, 1), q * h * h / 2, 1e-15);
  EXPECT_NEAR(Q(1, 0), q * h * h / 2, 1e-15);
  EXPECT_NEAR(Q(1, 1), q * h, 1e-15);
}

// Held noise is G dt, Q/dt: to first order in dt the same G Q Gᵀ; the Euler step is the discrete model of the
// paper.
TEST(Discretize, EulerWithHeldNoiseIsTheDiscreteVanDerPol) {
  const auto step = jml::discretize<jml::Euler, jml::HeldNoise>(ContinuousVanDerPol{});
  const models::VanDerPol expected{.dt = 0.04};
  const jml::StepContext<double> at{0, 0.04, {}};
  EXPECT_LT((jml::dynamics(step, x, at) - expected.dynamics(x)).norm(), 1e-16);
  EXPECT_LT((jml::dynamics_jacobian(step, x, at) - expected.dynamics_jacobian(x)).norm(), 1e-15);
  EXPECT_LT(
      (jml::dynamics_sdc<true>(step, x, jml::Vector<double, 2>(0, 0), at) - expected.dynamics_sdc(x)).norm(),
      1e-15);
  EXPECT_LT((jml::disturbance_input(step, x, at) - expected.disturbance_input()).norm(), 1e-16);
  EXPECT_LT((jml::disturbance_covariance(step, x, at) - expected.disturbance_covariance()).norm(), 1e-13);
}

// The Runge-Kutta step's own Jacobian and SDC, carried through its stages, hold their definitions; its order
// is 4.
TEST(Discretize, RungeKuttaCarriesJacobianAndSdc) {
  const auto step = jml::discretize<jml::RungeKutta4>(ContinuousVanDerPol{});
  EXPECT_TRUE(jml::check_model(step, x, jml::StepContext<double>{0, 0.2, {}}).ok());
  const auto end = [&](int steps) {
    jml::Vector<double, 2> z = x;
    for (int i = 0; i < steps; ++i) z = jml::dynamics(step, z, jml::StepContext<double>{0, 1.0 / steps, {}});
    return z;
  };
  const jml::Vector<double, 2> reference = end(4096);
  const double order = std::log2((end(16) - reference).norm() / (end(32) - reference).norm());
  EXPECT_NEAR(order, 4, 0.15);
}

}  // namespace
