// SPDX-License-Identifier: BSD-3-Clause
// The smoother over attitudes: at the last instant it is the filter, and where the errors are small it is the
// batch.
#include <gtest/gtest.h>

#include <random>

#include "models/attitude_in_space.hpp"

namespace {

using Turning = models::TurningIn<jml::SO3>;

jml::Vector<double, 3> random_vector(std::mt19937_64& random, double size) {
  std::normal_distribution<double> normal;
  return {size * normal(random), size * normal(random), size * normal(random)};
}

/// Largest distance of the smoother from the batch, of the attitudes in their deviations and of the
/// variances, relative, at a noise of `size` rad.
template <typename Method>
jml::Vector<double, 2> distance_from_batch(const Method& method, double size) {
  std::mt19937_64 random(11);
  const jml::Matrix<double, 3, 3> P = size * size * jml::Matrix<double, 3, 3>::Identity();
  const Turning model{P / 100};
  const jml::Vector<double, 4> x0 = jml::exp_quaternion(random_vector(random, 1));
  const jml::Estimate start{x0, P};
  jml::Filter filter{method, model, start};
  jml::Smoother smoother{filter, 20};
  jml::Batch batch{model, jml::sensors<models::VectorSensor>, start, {.steps = 20}};
  jml::Vector<double, 4> truth = jml::SO3::plus(x0, random_vector(random, size));
  for (int k = 0; k < 20; ++k) {
    const jml::Vector<double, 3> rate = random_vector(random, 1);
    jml::StepContext<double, 3> at;
    at.dt = 0.1;
    at.control = rate;
    truth = jml::SO3::plus(model.dynamics(truth, at), random_vector(random, size / 10));
    const models::VectorSensor sensor{random_vector(random, 1).normalized(), size};
    const jml::Vector<double, 3> y = sensor.measurement(truth) + random_vector(random, size);
    EXPECT_EQ(filter.step(sensor, y, 0.1, rate), jml::Status::ok);
    EXPECT_EQ(smoother.step(sensor, y, 0.1, rate), jml::Status::ok);
    EXPECT_EQ(batch.step(sensor, y, 0.1, rate), jml::Status::ok);
  }
  EXPECT_LT((filter.P() - smoother.P()).cwiseAbs().maxCoeff(), 1e-12 * P(0, 0));
  EXPECT_LT((filter.x() - smoother.x()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(smoother.smooth(), jml::Status::ok);
  EXPECT_EQ(batch.solve().status, jml::Status::ok);
  jml::Vector<double, 2> most(0, 0);
  for (int k = 0; k <= 20; ++k) {
    const jml::Matrix<double, 3, 3> Pk = batch.P(k);
    const jml::Vector<double, 3> off = jml::SO3::minus(smoother.x(k), batch.x(k));
    for (int i = 0; i < 3; ++i) {
      most(0) = std::max(most(0), std::abs(off(i)) / std::sqrt(Pk(i, i)));
      most(1) = std::max(most(1), std::abs(smoother.P(k)(i, i) / Pk(i, i) - 1));
    }
  }
  return most;
}

TEST(SmootherInSpace, IsTheBatchWhereErrorsAreSmall) {
  const auto coarse = distance_from_batch(jml::Ekf{}, 1e-2), fine = distance_from_batch(jml::Ekf{}, 1e-4);
  EXPECT_LT(coarse(0), 0.1);
  EXPECT_LT(coarse(1), 0.1);
  EXPECT_LT(fine(0), 0.02 * coarse(0));  // first order in the size of the errors
  EXPECT_LT(fine(1), 0.02 * coarse(1));
}

TEST(SmootherInSpace, SoIsTheFactored) {
  const auto fine = distance_from_batch(jml::Factored{jml::Ekf{}}, 1e-4);
  EXPECT_LT(fine(0), 2e-3);
  EXPECT_LT(fine(1), 2e-3);
}

}  // namespace
