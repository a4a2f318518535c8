// SPDX-License-Identifier: BSD-3-Clause
// Bounds on a nonlinear system: Batch, and a lag that covers the flight, against Ceres with bounds of
// parameters. The problem of Ceres is written here, model included. Its gradient by automatic derivatives at
// the answer is that of a minimum within the bounds, and shows every multiplier; from the answer Ceres finds
// nothing lower, nor from elsewhere, where its projected steps mostly stall far above.
#include <ceres/autodiff_cost_function.h>
#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <jml/campaign/noise.hpp>
#include <jml/interval/bounded_batch.hpp>
#include <vector>

#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;
using models::SaturatingPosition, models::VanDerPol, models::VanDerPolWhite;
using X = jml::Vector<double, 2>;
using Square = jml::Matrix<double, 2, 2>;

constexpr int steps = 60;
constexpr double dt = 0.1, c = 0.1, k_spring = 1, r = 0.02;

template <typename T>
std::array<T, 2> oscillator(const T& x, const T& v) {
  return {x + dt * v, v + dt * (-k_spring * x - 2.0 * c * (x * x - 1.0) * v)};
}
template <typename T>
T measured(const T& x) {
  using std::sqrt;
  return x / sqrt(1.0 + x * x);
}

/// ½ |root (x - f(previous))|², or of a prior where there is no f.
struct Step {
  Square root;
  template <typename T>
  bool operator()(const T* before, const T* x, T* out) const {
    const auto f = oscillator(before[0], before[1]);
    for (int i = 0; i < 2; ++i) out[i] = root(i, 0) * (x[0] - f[0]) + root(i, 1) * (x[1] - f[1]);
    return true;
  }
};
struct Prior {
  X mean;
  double inverse_deviation;
  template <typename T>
  bool operator()(const T* x, T* out) const {
    for (int i = 0; i < 2; ++i) out[i] = inverse_deviation * (x[i] - mean(i));
    return true;
  }
};
struct Measured {
  double y;
  template <typename T>
  bool operator()(const T* x, T* out) const {
    out[0] = (y - measured(x[0])) / std::sqrt(r);
    return true;
  }
};

const jml::Estimate<double, 2> prior{{1.4, 0.2}, 0.2 * Square::Identity()};

std::vector<double> flight(unsigned seed) {
  jml::Noise noise(seed);
  std::vector<double> y;
  std::array<double, 2> x{1.2, 0.0};
  for (int j = 0; j < steps; ++j) {
    x = oscillator(x[0], x[1] + 0.3 * noise.normal());
    y.push_back(measured(x[0]) + std::sqrt(r) * noise.normal());
  }
  return y;
}

double solve(::ceres::Problem& problem) {
  ::ceres::Solver::Options options;
  options.linear_solver_type = ::ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = options.parameter_tolerance = 1e-16;
  options.gradient_tolerance = 1e-11;
  options.logging_type = ::ceres::SILENT;
  ::ceres::Solver::Summary summary;
  ::ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

/// The parameters of `problem` are at the answer, of J = cost, within bounds whose multipliers are `mu`, in
/// the same order. How many act.
int expect_minimum(::ceres::Problem& problem, double J, const std::vector<double>& mu) {
  double cost = 0;
  std::vector<double> gradient;
  EXPECT_TRUE(problem.Evaluate({}, &cost, nullptr, &gradient, nullptr));
  EXPECT_NEAR(J, cost, 1e-9 * (1 + cost));
  EXPECT_EQ(gradient.size(), mu.size());
  int acting = 0;
  double largest = 0, worst = 0;
  for (std::size_t i = 0; i < mu.size(); ++i) {
    largest = std::max(largest, std::abs(mu[i]));
    worst = std::max(worst, std::abs(gradient[i] + mu[i]));
    acting += std::abs(mu[i]) > 0;
  }
  EXPECT_LT(worst, 2e-6 * (1 + largest));
  EXPECT_GT(solve(problem), cost * (1 - 1e-10));
  return acting;
}

TEST(BoundsOfStates, AreThoseOfCeres) {
  const VanDerPolWhite dynamics{{.dt = dt, .c = c, .k = k_spring, .q_c = 1}};
  const SaturatingPosition sensor{r};
  jml::Bounds<2> bounds;
  bounds.lower << -0.9, -0.7;
  bounds.upper << 0.8, 0.6;
  int acting = 0, most = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const auto y = flight(seed);
    jml::BoundedBatch batch{dynamics, jml::sensors<SaturatingPosition>, prior, {.steps = steps}, bounds};
    jml::Filter lag{jml::Bounded{jml::FixedLag<steps>{{.tolerance = 1e-9}}, bounds}, dynamics,
                    jml::sensors<SaturatingPosition>, prior};
    for (const double value : y) {
      ASSERT_EQ(batch.step(sensor, value), jml::Status::ok);
      const auto lagged = lag.step(sensor, value);
      ASSERT_TRUE(usable(lagged.status)) << jml::describe(lagged.status);
      most = std::max(most, lagged.sweeps);
    }
    const auto report = batch.solve();
    ASSERT_TRUE(usable(report.status)) << jml::describe(report.status);

    std::vector<X> x(steps + 1, X(0.1, 0.1));
    ::ceres::Problem problem;
    const Square root =
        Eigen::LLT<Square>(dynamics.disturbance_covariance()).matrixL().solve(Square::Identity());
    for (std::size_t j = 0; j <= steps; ++j) {
      problem.AddParameterBlock(x[j].data(), 2);
      for (int i = 0; i < 2; ++i) {
        problem.SetParameterLowerBound(x[j].data(), i, bounds.lower(i));
        problem.SetParameterUpperBound(x[j].data(), i, bounds.upper(i));
      }
      if (j == 0) {
        problem.AddResidualBlock(
            new ::ceres::AutoDiffCostFunction<Prior, 2, 2>(new Prior{prior.x, 1 / std::sqrt(prior.P(0, 0))}),
            nullptr, x[0].data());
        continue;
      }
      problem.AddResidualBlock(new ::ceres::AutoDiffCostFunction<Step, 2, 2, 2>(new Step{root}), nullptr,
                               x[j - 1].data(), x[j].data());
      problem.AddResidualBlock(new ::ceres::AutoDiffCostFunction<Measured, 1, 2>(new Measured{y[j - 1]}),
                               nullptr, x[j].data());
    }
    EXPECT_GT(solve(problem), report.cost);
    std::vector<double> mu;
    for (int j = 0; j <= steps; ++j) {
      x[static_cast<std::size_t>(j)] = batch.x(j);
      for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(batch.x(j)(i) >= bounds.lower(i) && batch.x(j)(i) <= bounds.upper(i));
        mu.push_back(batch.multiplier(j)(i));
      }
      ASSERT_LT((lag.x(steps - j) - batch.x(j)).cwiseAbs().maxCoeff(), 1e-6) << j;
    }
    acting += expect_minimum(problem, report.cost, mu);
  }
  EXPECT_GT(acting, 100);
  EXPECT_LE(most, 100);
}

// Noise of rank one, so Ceres has x_0 and the disturbances for its unknowns, and sums up the flight.
struct Shot {
  std::vector<double> y;
  double inverse_deviation;
  template <typename T>
  bool operator()(T const* const* given, T* out) const {
    std::array<T, 2> x{given[0][0], given[0][1]};
    for (int i = 0; i < 2; ++i)
      out[i] = (x[static_cast<std::size_t>(i)] - prior.x(i)) / std::sqrt(prior.P(0, 0));
    for (std::size_t j = 0; j < y.size(); ++j) {
      const T w = given[j + 1][0];
      x = oscillator(x[0], x[1]);
      x[1] += dt * w;
      out[2 * j + 2] = w * inverse_deviation;
      out[2 * j + 3] = (y[j] - measured(x[0])) / std::sqrt(r);
    }
    return true;
  }
};
TEST(BoundsOfDisturbances, AreThoseOfCeres) {
  const VanDerPol dynamics{.dt = dt, .c = c, .k = k_spring, .q_c = 1};
  const SaturatingPosition sensor{r};
  jml::Bounds<2, 1> bounds;
  bounds.w_lower << -0.3;
  bounds.w_upper << 0.4;
  int acting = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const auto y = flight(seed);
    jml::BoundedBatch batch{dynamics, jml::sensors<SaturatingPosition>, prior, {.steps = steps}, bounds};
    for (const double value : y) ASSERT_EQ(batch.step(sensor, value), jml::Status::ok);
    const auto report = batch.solve();
    ASSERT_TRUE(usable(report.status)) << jml::describe(report.status);

    X x0 = prior.x;
    std::vector<double> w(steps, 0.0);
    auto* cost = new ::ceres::DynamicAutoDiffCostFunction<Shot, 8>(new Shot{y, std::sqrt(dt)});
    cost->AddParameterBlock(2);
    std::vector<double*> blocks{x0.data()};
    for (double& value : w) {
      cost->AddParameterBlock(1);
      blocks.push_back(&value);
    }
    cost->SetNumResiduals(2 + 2 * steps);
    ::ceres::Problem problem;
    problem.AddResidualBlock(cost, nullptr, blocks);
    for (double& value : w) {
      problem.SetParameterLowerBound(&value, 0, bounds.w_lower(0));
      problem.SetParameterUpperBound(&value, 0, bounds.w_upper(0));
    }
    EXPECT_GT(solve(problem), report.cost * (1 - 1e-10));
    x0 = batch.x(0);
    std::vector<double> mu{0, 0};
    for (int j = 0; j < steps; ++j) {
      w[static_cast<std::size_t>(j)] = batch.w(j)(0);
      ASSERT_TRUE(batch.w(j)(0) >= bounds.w_lower(0) && batch.w(j)(0) <= bounds.w_upper(0));
      mu.push_back(batch.w_multiplier(j)(0));
    }
    acting += expect_minimum(problem, report.cost, mu);
  }
  EXPECT_GT(acting, 50);
}

}  // namespace
