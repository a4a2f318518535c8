// SPDX-License-Identifier: BSD-3-Clause
// Attitude in its space: exact step and batch against dense minima of a second derivation (rotation matrices
// by Rodrigues' formula, derivatives by differences in long double), quaternion against matrix, Wahba's
// problem.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <random>

#include "dense_attitude.hpp"
#include "models/attitude_in_space.hpp"

namespace {

using models::VectorSensor;
using Quaternion = models::TurningIn<jml::SO3>;
using Matrix9 = models::TurningIn<jml::SO3Matrix>;
using namespace oracle;

struct Scene {
  jml::Vector<double, 4> x0;
  jml::Matrix<double, 3, 3> P, Q;
  double sigma;
  jml::Vector<double, 3> direction[2], rate;
};
jml::Vector<double, 3> random_vector(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return {normal(random), normal(random), normal(random)};
}
jml::Matrix<double, 3, 3> random_covariance(std::mt19937_64& random, double size) {
  jml::Matrix<double, 3, 3> A;
  for (int j = 0; j < 3; ++j) A.col(j) = random_vector(random);
  return size * (A * A.transpose() + 0.1 * jml::Matrix<double, 3, 3>::Identity());
}
Scene random_scene(std::mt19937_64& random, double spread) {
  Scene scene;
  scene.x0 = jml::exp_quaternion(random_vector(random));
  scene.P = random_covariance(random, spread);
  scene.Q = random_covariance(random, spread / 4);
  scene.sigma = 0.1;
  for (auto& direction : scene.direction) direction = random_vector(random).normalized();
  scene.rate = random_vector(random);
  return scene;
}

/// Both vectors in one measurement.
struct Pair {
  static constexpr int measurements = 6;
  VectorSensor one, two;
  template <typename T, int numbers>
  jml::Vector<T, 6> measurement(const Eigen::Matrix<T, numbers, 1>& x) const {
    jml::Vector<T, 6> out;
    out << one.measurement(x), two.measurement(x);
    return out;
  }
  jml::Matrix<double, 6, 6> noise_covariance() const {
    return one.sigma * one.sigma * jml::Matrix<double, 6, 6>::Identity();
  }
};
Pair pair_of(const Scene& scene) {
  return {{scene.direction[0], scene.sigma}, {scene.direction[1], scene.sigma}};
}

/// J of (δ_0, w_0, w_1, …) for measurements at the ends of the steps, and the attitudes.
struct Dense {
  const Scene& scene;
  const std::vector<jml::Vector<double, 6>>& y;
  double dt;

  std::vector<Matrix3> attitudes(const Unknowns& z) const {
    std::vector<Matrix3> out{matrix_of(scene.x0) * rodrigues(z.head<3>())};
    for (std::size_t k = 0; k < y.size(); ++k) {
      const Vector3 w = z.segment<3>(3 + 3 * static_cast<Eigen::Index>(k));
      out.push_back(out.back() * rodrigues(dt * scene.rate.cast<Real>()) * rodrigues(w));
    }
    return out;
  }
  Real operator()(const Unknowns& z) const {
    const auto R = attitudes(z);
    const Matrix3 P = scene.P.cast<Real>(), Q = scene.Q.cast<Real>();
    const Vector3 d = z.head<3>();
    Real sum = d.dot(P.ldlt().solve(d));
    for (std::size_t k = 0; k < y.size(); ++k) {
      const Vector3 w = z.segment<3>(3 + 3 * static_cast<Eigen::Index>(k));
      sum += w.dot(Q.ldlt().solve(w));
      for (int i = 0; i < 2; ++i) {
        const Vector3 seen = R[k + 1].transpose() * scene.direction[i].cast<Real>();
        sum += (y[k].segment<3>(3 * i).cast<Real>() - seen).squaredNorm() / (Real(scene.sigma) * scene.sigma);
      }
    }
    return sum / 2;
  }
};

jml::Vector<double, 6> random_measurement(const Scene& scene, const Matrix3& R, std::mt19937_64& random) {
  jml::Vector<double, 6> y;
  for (int i = 0; i < 2; ++i)
    y.segment<3>(3 * i) = (R.transpose() * scene.direction[i].cast<Real>()).cast<double>() +
                          scene.sigma * random_vector(random);
  return y;
}
/// A flight of so many steps as the model says.
std::vector<jml::Vector<double, 6>> random_flight(const Scene& scene, int steps, double dt,
                                                  std::mt19937_64& random) {
  std::vector<jml::Vector<double, 6>> y;
  const auto root = [](const jml::Matrix<double, 3, 3>& C) {
    return jml::Matrix<double, 3, 3>(C.llt().matrixL());
  };
  Matrix3 R = matrix_of(scene.x0) * rodrigues((root(scene.P) * random_vector(random)).cast<Real>());
  for (int k = 0; k < steps; ++k) {
    R = R * rodrigues(dt * scene.rate.cast<Real>()) *
        rodrigues((root(scene.Q) * random_vector(random)).cast<Real>());
    y.push_back(random_measurement(scene, R, random));
  }
  return y;
}

// Priors of half a radian and disturbances of a quarter: J_r of both, Ad and the map of the noise all count.
TEST(Attitude, ExactStepIsTheDenseMinimum) {
  std::mt19937_64 random(3);
  int usable = 0;
  for (int i = 0; i < 40; ++i) {
    const Scene scene = random_scene(random, 0.1);
    const auto y = random_flight(scene, 1, 0.5, random);
    const Dense J{scene, y, 0.5};
    jml::Filter filter{jml::Iterated<jml::Ekf<>>{}, Quaternion{scene.Q}, jml::Estimate{scene.x0, scene.P}};
    const auto report = filter.step(pair_of(scene), y[0], 0.5, scene.rate);
    if (!jml::usable(report.status)) {
      ADD_FAILURE() << i << ' ' << jml::describe(report.status);
      continue;
    }
    ++usable;
    // The minimum that is nearest to the answer.
    Unknowns z = Unknowns::Zero(6);
    const Unknowns best = dense_minimum(J, z);
    EXPECT_LT(angle_between(J.attitudes(best).back(), matrix_of(filter.x())), 1e-8) << i;
    EXPECT_NEAR(report.cost, static_cast<double>(J(best)), 1e-8) << i;
  }
  EXPECT_EQ(usable, 40);
}

TEST(Attitude, BatchIsTheDenseMinimum) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 10; ++i) {
    const Scene scene = random_scene(random, 0.05);
    const auto y = random_flight(scene, 4, 0.5, random);
    const Dense J{scene, y, 0.5};
    jml::Batch batch{Quaternion{scene.Q}, jml::sensors<Pair>, jml::Estimate{scene.x0, scene.P}, {.steps = 4}};
    for (const auto& sample : y)
      ASSERT_EQ(batch.step(pair_of(scene), sample, 0.5, scene.rate), jml::Status::ok);
    const auto report = batch.solve();
    ASSERT_EQ(report.status, jml::Status::ok) << i;
    const Unknowns best = dense_minimum(J, Unknowns::Zero(15));
    EXPECT_NEAR(report.cost, static_cast<double>(J(best)), 1e-9 * (1 + report.cost)) << i;
    const auto R = J.attitudes(best);
    for (int k = 0; k <= 4; ++k)
      EXPECT_LT(angle_between(R[static_cast<std::size_t>(k)], matrix_of(batch.x(k))), 1e-8) << i << ' ' << k;
    // Again from the filter: the same numbers, whatever the answer before left behind.
    const auto again = batch.solve();
    EXPECT_EQ(again.cost, report.cost);
    EXPECT_EQ(again.iterations, report.iterations);
  }
}

// A rotation matrix in place of the quaternion: the same filter, lag and batch.
TEST(Attitude, NineNumbersAreTheSame) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 10; ++i) {
    const Scene scene = random_scene(random, 0.02);
    const auto y = random_flight(scene, 30, 0.1, random);
    const Matrix3 R0 = matrix_of(scene.x0);
    jml::Vector<double, 9> r0;
    for (int k = 0; k < 9; ++k) r0(k) = static_cast<double>(R0.data()[k]);
    jml::Filter four{jml::Ekf{}, Quaternion{scene.Q}, jml::Estimate{scene.x0, scene.P}};
    jml::Filter nine{jml::Ekf{}, Matrix9{scene.Q}, jml::Estimate{r0, scene.P}};
    jml::Filter four_lag{jml::FixedLag<3>{}, Quaternion{scene.Q}, jml::sensors<Pair>,
                         jml::Estimate{scene.x0, scene.P}};
    jml::Filter factored{jml::Factored{jml::Ekf{}}, Matrix9{scene.Q}, jml::Estimate{r0, scene.P}};
    for (const auto& sample : y) {
      ASSERT_EQ(four.step(pair_of(scene), sample, 0.1, scene.rate), jml::Status::ok);
      ASSERT_EQ(nine.step(pair_of(scene), sample, 0.1, scene.rate), jml::Status::ok);
      ASSERT_EQ(factored.step(pair_of(scene), sample, 0.1, scene.rate), jml::Status::ok);
      ASSERT_TRUE(jml::usable(four_lag.step(pair_of(scene), sample, 0.1, scene.rate)));
      EXPECT_TRUE(jml::SO3Matrix::contains(nine.x()));
      const Matrix3 R = matrix_of(four.x());
      Matrix3 R9, R9f;
      for (int k = 0; k < 9; ++k) {
        R9.data()[k] = nine.x()(k);
        R9f.data()[k] = factored.x()(k);
      }
      EXPECT_LT((R - R9).cwiseAbs().maxCoeff(), 1e-12L);
      EXPECT_LT((R - R9f).cwiseAbs().maxCoeff(), 1e-11L);
      EXPECT_LT((four.P() - nine.P()).cwiseAbs().maxCoeff(), 1e-13);
      EXPECT_LT((four.P() - factored.P()).cwiseAbs().maxCoeff(), 1e-13);
    }
  }
}

/// A constant attitude without disturbances.
struct Still {
  using Space = jml::SO3;
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return x;
  }
};

// Wahba's problem: nothing known, several vectors. The least squares attitude is U diag(1, 1, det) Vᵀ of
// B = Σ d yᵀ / σ².
TEST(Attitude, BatchSolvesWahba) {
  std::mt19937_64 random(6);
  int failed = 0, escaped = 0;
  for (int i = 0; i < 1000; ++i) {
    const Scene scene = random_scene(random, 0.1);
    const Matrix3 truth = matrix_of(jml::exp_quaternion(random_vector(random)));
    Scene seen = scene;
    while (std::abs(seen.direction[0].dot(seen.direction[1])) > 0.8)
      seen.direction[1] = random_vector(random).normalized();
    const auto y = random_measurement(seen, truth, random);
    jml::Matrix<double, 3, 3> P;
    P.setZero();
    P.diagonal().setConstant(std::numeric_limits<double>::infinity());
    jml::Batch batch{Still{}, jml::sensors<Pair>, jml::Estimate{seen.x0, P}, {.steps = 0, .measurements = 1}};
    ASSERT_EQ(batch.update(pair_of(seen), y), jml::Status::ok);
    batch.options.tolerance = 1e-13;
    const auto report = batch.solve();
    jml::Matrix<double, 3, 3> B = jml::Matrix<double, 3, 3>::Zero();
    for (int k = 0; k < 2; ++k) B += seen.direction[k] * y.segment<3>(3 * k).transpose();
    const Eigen::JacobiSVD<jml::Matrix<double, 3, 3>> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
    jml::Matrix<double, 3, 3> sign = jml::Matrix<double, 3, 3>::Identity();
    sign(2, 2) = svd.matrixU().determinant() * svd.matrixV().determinant();
    const Matrix3 best = (svd.matrixU() * sign * svd.matrixV().transpose()).cast<Real>();
    const double off = angle_between(best, matrix_of(batch.x(0)));
    failed += !jml::usable(report.status) || off > 1e-12;
    escaped += report.iterations > 8;
  }
  RecordProperty("took_more_than_eight_iterations", escaped);
  EXPECT_EQ(failed, 0);
}

}  // namespace
