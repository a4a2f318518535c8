// SPDX-License-Identifier: BSD-3-Clause
// The whole-interval problem by Ceres: what is frozen along the way, closed forms, refusals.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <stdexcept>

#include "ceres/batch_flights.hpp"
#include "models/van_der_pol.hpp"

namespace {

using batch_flights::expect_agreement;
using Square = jml::Matrix<double, 2, 2>;

jml::Estimate<double, 2> oscillator(double p11, double p12, double p22) {
  jml::Estimate<double, 2> out{{1, 0}, Square::Zero()};
  out.P << p11, p12, p12, p22;
  return out;
}

/// w̄ and Q change along the way, with the state and with time.
struct Pushed : models::VanDerPol {
  using At = jml::StepContext<double>;
  jml::Vector<double, 1> disturbance_mean(const jml::Vector<double, 2>& x, const At& at) const {
    return jml::Vector<double, 1>(0.5 + 0.2 * x(1) + 0.1 * std::sin(at.time));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance(const jml::Vector<double, 2>& x) const {
    return jml::Matrix<double, 1, 1>((1 + 0.3 * x(0) * x(0)) * q_c / dt);
  }
};
/// R grows with the distance.
struct Fading : models::SaturatingPosition {
  jml::Matrix<double, 1, 1> noise_covariance(const jml::Vector<double, 2>& x) const {
    return jml::Matrix<double, 1, 1>(r * (1 + x(0) * x(0)));
  }
};
struct Speed {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(1));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};

// Two types of sensors, two measurements of a node, one of x_0, and steps without any.
TEST(Agreement, OfWhatIsFrozenAlongTheWay) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    jml::Noise noise(seed);
    const Pushed dynamics;
    const auto prior = oscillator(0.1, 0, 0.1);
    jml::Batch by_sweep{dynamics, jml::sensors<Fading, Speed>, prior, {200, 200}};
    jml::Vector<double, 2> x = prior.x;
    EXPECT_EQ(by_sweep.update(Fading{}, Fading{}.measurement(x)), jml::Status::ok);
    for (int k = 0; k < 200; ++k) {
      const jml::StepContext<double> at{by_sweep.time(k), dynamics.dt, {}};
      const double sd = std::sqrt(dynamics.disturbance_covariance(x)(0));
      const double w = dynamics.disturbance_mean(x, at)(0) + sd * noise.normal();
      x = (dynamics.dynamics(x) + dynamics.disturbance_input() * w).eval();
      EXPECT_EQ(by_sweep.predict(dynamics.dt), jml::Status::ok);
      if (k % 3 == 0) continue;
      const double error = noise.normal() * std::sqrt(Fading{}.noise_covariance(x)(0));
      EXPECT_EQ(by_sweep.update(Fading{}, Fading{}.measurement(x)(0) + error), jml::Status::ok);
      if (k % 5 != 0) continue;
      EXPECT_EQ(by_sweep.update(Speed{}, x(1) + 0.3 * noise.normal()), jml::Status::ok);
    }
    auto by_ceres = by_sweep;
    // J changes with what is frozen to first order in the error of x, so that it agrees less well here.
    expect_agreement(by_sweep, by_ceres, {}, 1e-7);
  }
}

/// No disturbances at all: x⁺ = 0.9 x.
struct Decay {
  static constexpr int states = 1, disturbances = 0;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(0.9 * x(0));
  }
};
struct Twice {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 1>& x) const {
    return {x(0), 2.0 * x(0)};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    Square R;
    R << 1, 0.5, 0.5, 2;
    return R;
  }
};

// x_0 is the mean of the prior and of y_k / 0.9^k, weighted by what each knows of it.
TEST(CeresEngine, ClosedFormWithoutDisturbances) {
  const jml::Estimate<double, 1> prior{jml::Vector<double, 1>(3.0), jml::Matrix<double, 1, 1>(4.0)};
  jml::Batch batch{Decay{}, jml::sensors<Twice>, prior, {20}};
  const Square R = Twice{}.noise_covariance();
  double weight = 1 / prior.P(0), sum = prior.x(0) / prior.P(0), square = prior.x(0) * sum, factor = 1;
  for (int k = 0; k < 20; ++k) {
    factor *= 0.9;
    const jml::Vector<double, 2> y(2 * factor + 0.5 * std::sin(k), 4 * factor + std::cos(2 * k)),
        h(factor, 2 * factor);
    EXPECT_EQ(batch.step(Twice{}, y), jml::Status::ok);
    weight += h.dot(R.inverse() * h);
    sum += h.dot(R.inverse() * y);
    square += y.dot(R.inverse() * y);
  }
  const auto report = jml::solve_with_ceres(batch);
  EXPECT_EQ(report.status, jml::Status::ok) << report.last.message;
  EXPECT_NEAR(batch.x(0)(0), sum / weight, 1e-9);
  EXPECT_NEAR(batch.x(20)(0), factor * sum / weight, 1e-9);
  EXPECT_NEAR(report.cost, (square - sum * sum / weight) / 2, 1e-10 * report.cost);
  EXPECT_LE(report.gradient, 1e-6);
}

/// x⁺ = x - 0.1 x² + w.
struct Bent {
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) - 0.1 * x(0) * x(0));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.3); }
};

// Away from the answer: |∇J| over (a, b) by central differences along the model's own run.
TEST(CeresEngine, GradientByDifferences) {
  const jml::Loss loss = jml::Loss::huber(1);
  const jml::Estimate<double, 1> prior{jml::Vector<double, 1>(3.0), jml::Matrix<double, 1, 1>(4.0)};
  jml::Batch batch{Bent{}, jml::sensors<Twice>, prior, {5}};
  const auto y = [](int k) { return jml::Vector<double, 2>(2 + std::sin(k), 3 + std::cos(2 * k)); };
  for (int k = 0; k < 5; ++k) EXPECT_EQ(batch.step(Twice{}, y(k)), jml::Status::ok);
  batch.options.loss = loss;
  jml::CeresOptions options;
  options.solver.max_num_iterations = 1;
  const auto report = jml::solve_with_ceres(batch, options);
  EXPECT_EQ(report.status, jml::Status::not_converged);

  jml::Vector<double, 6> z;  // a and five b
  z(0) = (batch.x(0)(0) - prior.x(0)) / 2;
  for (int k = 0; k < 5; ++k) z(k + 1) = batch.w(k)(0) / std::sqrt(0.3);
  const auto J = [&](const jml::Vector<double, 6>& of) {
    double sum = of.squaredNorm() / 2;
    jml::Vector<double, 1> x(prior.x(0) + 2 * of(0));
    for (int k = 0; k < 5; ++k) {
      x = jml::Vector<double, 1>(Bent{}.dynamics(x)(0) + std::sqrt(0.3) * of(k + 1));
      const jml::Vector<double, 2> r = y(k) - Twice{}.measurement(x);
      const double s = std::sqrt(r.dot(Twice{}.noise_covariance().inverse() * r));
      sum += s <= 1 ? s * s / 2 : s - 0.5;
    }
    return sum;
  };
  EXPECT_NEAR(report.cost, J(z), 1e-12 * J(z));
  double squared = 0;
  for (int i = 0; i < 6; ++i) {
    const jml::Vector<double, 6> h = 1e-5 * jml::Vector<double, 6>::Unit(i);
    const double slope = (J(z + h) - J(z - h)) / 2e-5;
    squared += slope * slope;
  }
  EXPECT_GT(squared, 1e-4);  // there is something to see
  EXPECT_NEAR(report.gradient, std::sqrt(squared), 1e-7 * std::sqrt(squared));
}

/// R = limit - x² or so, no covariance far away.
struct Sharpening : Twice {
  double limit = 20;
  Square noise_covariance(const jml::Vector<double, 1>& x) const {
    return (limit - x(0) * x(0)) * Twice::noise_covariance();
  }
};

TEST(Agreement, OfRegularNoiseAndChangingR) {
  const jml::Estimate<double, 1> prior{jml::Vector<double, 1>(3.0), jml::Matrix<double, 1, 1>(4.0)};
  jml::Batch by_sweep{Bent{}, jml::sensors<Sharpening>, prior, {30}};
  for (int k = 0; k < 30; ++k) {
    const jml::Vector<double, 2> y(2 + std::sin(k), 3 + std::cos(2 * k));
    EXPECT_EQ(by_sweep.step(Sharpening{}, y), jml::Status::ok);
  }
  auto by_ceres = by_sweep;
  const auto report = expect_agreement(by_sweep, by_ceres, {}, 1e-7);
  EXPECT_GT(report.rounds, 2);

  jml::Batch none{Bent{}, jml::sensors<Sharpening>, prior, {1}};
  EXPECT_EQ(none.step(Sharpening{{}, 0.1}, {2, 3}), jml::Status::ok);
  EXPECT_EQ(jml::solve_with_ceres(none).status, jml::Status::invalid_noise_covariance);
}

/// Fails in the way that `when` says where x_0 exceeds 2.
struct Failing : models::VanDerPol {
  enum class When { nan, throws } when = When::nan;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    if (x(0) > 2.0 && when == When::throws) throw std::runtime_error("model");
    return x(0) > 2.0 ? jml::Vector<T, 2>(x * std::nan("")) : models::VanDerPol::dynamics(x);
  }
};

TEST(CeresEngine, RefusalsThrowNothingAndPrintNothing) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  const auto recorded = [](const Failing& dynamics) {
    jml::Batch batch{dynamics, jml::sensors<models::SaturatingPosition>, oscillator(0.1, 0, 0.1), {20}};
    for (int k = 0; k < 20; ++k) EXPECT_EQ(batch.step(models::SaturatingPosition{}, 0.6), jml::Status::ok);
    batch.start = jml::Start::given;
    for (int k = 0; k <= 20; ++k) batch.recording().node(k).x[batch.recording().now()] = {3, 0};
    return batch;
  };
  auto nan = recorded({}), throws = recorded({{}, Failing::When::throws});
  EXPECT_EQ(jml::solve_with_ceres(nan).status, jml::Status::dynamics_not_finite);
  EXPECT_EQ(jml::solve_with_ceres(throws).status, jml::Status::not_converged);
  nan.start = throws.start = jml::Start::filter;  // stays below 2
  EXPECT_EQ(jml::solve_with_ceres(nan).status, jml::Status::ok);
  EXPECT_EQ(jml::solve_with_ceres(throws).status, jml::Status::ok);

  jml::CeresOptions options;
  options.solver.max_num_iterations = 1;
  EXPECT_EQ(jml::solve_with_ceres(nan, options).status, jml::Status::not_converged);
  options.solver.max_num_iterations = -1;
  EXPECT_EQ(jml::solve_with_ceres(nan, options).status, jml::Status::invalid_option);
  EXPECT_EQ(jml::solve_with_ceres(nan, {.softness = 0}).status, jml::Status::invalid_option);
  EXPECT_EQ(jml::solve_with_ceres(nan, {.max_rounds = 0}).status, jml::Status::invalid_option);
  jml::Batch bad{models::VanDerPol{}, jml::sensors<models::SaturatingPosition>, oscillator(-1, 0, 1), {1}};
  EXPECT_EQ(jml::solve_with_ceres(bad).status, jml::Status::invalid_covariance);
  jml::Batch empty{models::VanDerPol{}, jml::sensors<models::SaturatingPosition>, oscillator(1, 0, 1), {1}};
  EXPECT_EQ(jml::solve_with_ceres(empty).status, jml::Status::ok);
  EXPECT_EQ(empty.x(0), empty.recording().estimate().x);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

// P_0 = 0 and a measurement of x_0: nothing to move, but it counts.
TEST(CeresEngine, MeasurementOfAKnownState) {
  jml::Batch batch{models::VanDerPol{}, jml::sensors<models::SaturatingPosition>, oscillator(0, 0, 0), {1}};
  EXPECT_EQ(batch.update(models::SaturatingPosition{}, 1.0), jml::Status::ok);
  const double residual = 1 - 1 / std::sqrt(2.0),
               expected = residual * residual / models::SaturatingPosition{}.r / 2;
  EXPECT_NEAR(jml::solve_with_ceres(batch).cost, expected, 1e-14 * expected);
  EXPECT_EQ(batch.predict(), jml::Status::ok);
  EXPECT_NEAR(jml::solve_with_ceres(batch).cost, expected, 1e-14 * expected);
}

}  // namespace
