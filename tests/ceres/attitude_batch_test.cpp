// SPDX-License-Identifier: BSD-3-Clause
// The batch of attitudes against Ceres itself: its manifold of quaternions, its rotations, its automatic
// derivatives; nothing of it is shared with jml. Unknowns are the attitudes, a disturbance is
// log((q_k Exp(rate dt))⁻¹ q_{k+1}), the prior's term log(q̂_0⁻¹ q_0).
#include <ceres/autodiff_cost_function.h>
#include <ceres/covariance.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "models/attitude_in_space.hpp"

namespace {

using State = jml::Vector<double, 4>;
using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using models::VectorSensor;
using Turning = models::TurningIn<jml::SO3>;

/// L⁻¹ log((a b)⁻¹ c), with b known.
template <typename T>
void whitened_difference(const T a[4], const State& b, const T c[4], const Matrix3& inverse_root, T* out) {
  const T known[4] = {T(b(0)), T(b(1)), T(b(2)), T(b(3))};
  T ab[4], off[4], angle[3];
  ceres::QuaternionProduct(a, known, ab);
  const T back[4] = {ab[0], -ab[1], -ab[2], -ab[3]};
  ceres::QuaternionProduct(back, c, off);
  ceres::QuaternionToAngleAxis(off, angle);
  for (int i = 0; i < 3; ++i)
    out[i] = inverse_root(i, 0) * angle[0] + inverse_root(i, 1) * angle[1] + inverse_root(i, 2) * angle[2];
}
Matrix3 inverse_root(const Matrix3& C) { return C.llt().matrixL().solve(Matrix3(Matrix3::Identity())); }
struct Prior {
  State x0;
  Matrix3 weight;
  template <typename T>
  bool operator()(const T* q, T* out) const {
    const T at[4] = {T(x0(0)), T(x0(1)), T(x0(2)), T(x0(3))};
    whitened_difference(at, State(1, 0, 0, 0), q, weight, out);
    return true;
  }
};
struct Step {
  State turn;
  Matrix3 weight;
  template <typename T>
  bool operator()(const T* q, const T* next, T* out) const {
    whitened_difference(q, turn, next, weight, out);
    return true;
  }
};
struct Seen {
  Vector3 direction, y;
  double sigma;
  template <typename T>
  bool operator()(const T* q, T* out) const {
    const T back[4] = {q[0], -q[1], -q[2], -q[3]}, d[3] = {T(direction(0)), T(direction(1)), T(direction(2))};
    T seen[3];
    ceres::UnitQuaternionRotatePoint(back, d, seen);
    for (int i = 0; i < 3; ++i) out[i] = (y(i) - seen[i]) / sigma;
    return true;
  }
};
template <int outputs, int... inputs, typename Functor>
ceres::CostFunction* derived(const Functor& functor) {
  return new ceres::AutoDiffCostFunction<Functor, outputs, inputs...>(new Functor(functor));
}

State turn_by(const Vector3& angle) {
  State q;
  ceres::AngleAxisToQuaternion(angle.data(), q.data());
  return q;
}
State product(const State& a, const State& b) {
  State out;
  ceres::QuaternionProduct(a.data(), b.data(), out.data());
  return out;
}
double angle_between(const State& a, const State& b) {
  const State off = product(State(a(0), -a(1), -a(2), -a(3)), b);
  return 2 * std::atan2(off.tail<3>().norm(), std::abs(off(0)));
}

struct Measurement {
  int node;
  VectorSensor sensor;
  Vector3 y;
};
struct Flight {
  State x0;
  Matrix3 P, Q;
  double dt = 0.3;
  std::vector<Vector3> rate;
  std::vector<Measurement> seen;
};
struct Draw {
  std::mt19937_64 random;
  std::normal_distribution<double> normal{};
  Vector3 vector() { return {normal(random), normal(random), normal(random)}; }
  Matrix3 covariance(double size) {
    Matrix3 A;
    for (int j = 0; j < 3; ++j) A.col(j) = vector();
    return size * (A * A.transpose() + 0.1 * Matrix3::Identity());
  }
  Vector3 sample(const Matrix3& C) { return C.llt().matrixL() * vector(); }
};
/// Priors of a fifth of a radian to half of one, disturbances of a tenth to a third; some nodes see nothing.
Flight random_flight(std::uint64_t seed) {
  Draw draw{std::mt19937_64(seed)};
  std::uniform_real_distribution<double> uniform(0, 1);
  const int steps = 3 + static_cast<int>(10 * uniform(draw.random));
  Flight flight;
  flight.x0 = turn_by(draw.vector());
  flight.P = draw.covariance(0.02 + 0.1 * uniform(draw.random));
  flight.Q = draw.covariance(0.003 + 0.03 * uniform(draw.random));
  State truth = product(flight.x0, turn_by(draw.sample(flight.P)));
  for (int k = 0; k <= steps; ++k) {
    for (int i = 0; i < 2; ++i) {
      if (uniform(draw.random) < 0.3) continue;
      const VectorSensor sensor{draw.vector().normalized(), 0.02 + 0.2 * uniform(draw.random)};
      const State back(truth(0), -truth(1), -truth(2), -truth(3));
      Vector3 y;
      ceres::UnitQuaternionRotatePoint(back.data(), sensor.direction.data(), y.data());
      flight.seen.push_back({k, sensor, y + sensor.sigma * draw.vector()});
    }
    flight.rate.push_back(draw.vector());
    truth = product(product(truth, turn_by(flight.dt * flight.rate.back())), turn_by(draw.sample(flight.Q)));
  }
  flight.rate.pop_back();
  return flight;
}

/// J, its attitudes and their covariances in the body's axes by Ceres, from the prediction.
double solve_by_ceres(const Flight& flight, std::vector<State>& q, std::vector<Matrix3>& P) {
  ceres::Problem problem;
  q = {flight.x0};
  for (const Vector3& rate : flight.rate) q.push_back(product(q.back(), turn_by(flight.dt * rate)));
  for (State& each : q) problem.AddParameterBlock(each.data(), 4, new ceres::QuaternionManifold);
  problem.AddResidualBlock(derived<3, 4>(Prior{flight.x0, inverse_root(flight.P)}), nullptr, q[0].data());
  for (std::size_t k = 0; k + 1 < q.size(); ++k) {
    const Step step{turn_by(flight.dt * flight.rate[k]), inverse_root(flight.Q)};
    problem.AddResidualBlock(derived<3, 4, 4>(step), nullptr, q[k].data(), q[k + 1].data());
  }
  for (const auto& [node, sensor, y] : flight.seen)
    problem.AddResidualBlock(derived<3, 4>(Seen{sensor.direction, y, sensor.sigma}), nullptr,
                             q[static_cast<std::size_t>(node)].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 500;
  options.function_tolerance = options.parameter_tolerance = 1e-16;
  options.gradient_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();
  ceres::Covariance::Options how;
  how.algorithm_type = ceres::DENSE_SVD;
  ceres::Covariance covariance(how);
  std::vector<std::pair<const double*, const double*>> blocks;
  for (const State& each : q) blocks.emplace_back(each.data(), each.data());
  EXPECT_TRUE(covariance.Compute(blocks, &problem));
  for (const State& each : q) {
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> C, R;
    covariance.GetCovarianceBlockInTangentSpace(each.data(), each.data(), C.data());
    ceres::QuaternionToRotation(each.data(), R.data());
    P.push_back(4 * R.transpose() * C * R);  // Ceres moves q by (cos |δ|, sin |δ| δ / |δ|) q
  }
  return summary.final_cost;
}

TEST(AttitudeBatch, IsThatOfCeres) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    const Flight flight = random_flight(seed);
    const int steps = static_cast<int>(flight.rate.size());
    jml::Batch batch{Turning{flight.Q},
                     jml::sensors<VectorSensor>,
                     jml::Estimate{flight.x0, flight.P},
                     {.steps = steps, .measurements = 2 * steps + 2}};
    auto next = flight.seen.begin();
    for (int k = 0; k <= steps; ++k) {
      for (; next != flight.seen.end() && next->node == k; ++next)
        ASSERT_EQ(batch.update(next->sensor, next->y), jml::Status::ok);
      if (k == steps) break;
      const Vector3& rate = flight.rate[static_cast<std::size_t>(k)];
      ASSERT_EQ(batch.predict(flight.dt, rate), jml::Status::ok);
    }
    const auto report = batch.solve();
    ASSERT_TRUE(jml::usable(report.status)) << report.status;
    std::vector<State> q;
    std::vector<Matrix3> P;
    const double J = solve_by_ceres(flight, q, P);
    EXPECT_NEAR(report.cost, J, 1e-9 * (1 + J));
    for (int k = 0; k <= steps; ++k) {
      const auto i = static_cast<std::size_t>(k);
      EXPECT_LT(angle_between(batch.x(k), q[i]), 1e-6) << k;
      EXPECT_LT((batch.P(k) - P[i]).norm(), 1e-5 * P[i].norm()) << k;
      if (k == steps) break;
      Vector3 w;
      whitened_difference(q[i].data(), turn_by(flight.dt * flight.rate[i]), q[i + 1].data(),
                          Matrix3(Matrix3::Identity()), w.data());
      EXPECT_LT((batch.w(k) - w).norm(), 1e-6) << k;
    }
  }
}

}  // namespace
