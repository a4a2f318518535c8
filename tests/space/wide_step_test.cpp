// SPDX-License-Identifier: BSD-3-Clause
// Exact steps whose disturbance enters where it bends: turns of 0.7 rad, and x⁺ = x exp(w). The root is the
// least minimum of the criterion: oracles are minima from many starts of a second derivation (rotation
// matrices by Rodrigues' formula), and of one written down for the scalar.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "dense_attitude.hpp"
#include "figure.hpp"
#include "heap_trap.hpp"
#include "models/attitude_in_space.hpp"

namespace {

using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Vector6 = jml::Vector<double, 6>;
using Turning = models::TurningIn<jml::SO3>;
using models::VectorSensor;

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

/// J of u = (a, b), x_0 = x̂ Exp(L a), w = W b, over one step of turn `step`.
struct Whole {
  Matrix3 R0, L, W, step;
  Vector3 direction[2];
  Vector6 y;
  double sigma;

  static Matrix3 turn(const Vector3& v) { return oracle::rodrigues(v.cast<oracle::Real>()).cast<double>(); }
  Matrix3 attitude(const Vector6& u) const {
    return R0 * turn(L * u.head<3>()) * step * turn(W * u.tail<3>());
  }
  jml::Vector<double, 12> residuals(const Vector6& u) const {
    jml::Vector<double, 12> r;
    r.head<6>() = u;
    const Matrix3 R = attitude(u);
    for (int i = 0; i < 2; ++i)
      r.segment<3>(6 + 3 * i) = (y.segment<3>(3 * i) - R.transpose() * direction[i]) / sigma;
    return r;
  }
  double cost(const Vector6& u) const { return residuals(u).squaredNorm() / 2; }

  /// Down from u: Gauss and Newton with a damping, derivatives by differences.
  double descend(Vector6& u) const {
    constexpr double h = 1e-6;
    double damping = 1e-3, now = cost(u);
    for (int k = 0; k < 200; ++k) {
      const auto r = residuals(u);
      jml::Matrix<double, 12, 6> J;
      for (int j = 0; j < 6; ++j) {
        Vector6 ahead = u, back = u;
        ahead(j) += h;
        back(j) -= h;
        J.col(j) = (residuals(ahead) - residuals(back)) / (2 * h);
      }
      const jml::Matrix<double, 6, 6> H = J.transpose() * J;
      const double size = H.trace() / 6;
      double lower = now;
      for (int again = 0; again < 20 && lower >= now; ++again, damping *= 4) {
        jml::Matrix<double, 6, 6> damped = H;
        damped.diagonal().array() += damping * size;
        const Vector6 there = u - damped.ldlt().solve(J.transpose() * r);
        if (cost(there) < now) {
          lower = cost(there);
          u = there;
        }
      }
      if (!(lower < now * (1 - 1e-14))) break;
      now = lower;
      damping = std::max(damping / 20, 1e-12);
    }
    return now;
  }
};

TEST(WideStep, ItsRootIsTheLeastMinimum) {
  std::mt19937_64 random(1), starts(2);
  std::normal_distribution<double> normal;
  const auto some = [&]() -> Vector3 {
    const double a = normal(random), b = normal(random), c = normal(random);
    return {a, b, c};
  };
  const auto covariance = [&](double size) {
    Matrix3 A;
    for (int j = 0; j < 3; ++j) A.col(j) = some();
    return Matrix3(size * (A * A.transpose() + 0.1 * Matrix3::Identity()));
  };
  int iterations = 0;
  constexpr int scenes = 60;
  for (int i = 0; i < scenes; ++i) {
    const double spread = i % 2 == 0 ? 0.5 : 0.2;  // of x; a quarter of it of w: 0.7 and 0.4 rad
    const jml::Vector<double, 4> x0 = jml::exp_quaternion(some());
    const Matrix3 P = covariance(spread), Q = covariance(spread / 4);
    const Vector3 rate = some();
    Whole whole{oracle::matrix_of(x0).cast<double>(),
                P.llt().matrixL(),
                Q.llt().matrixL(),
                Whole::turn(0.5 * rate),
                {},
                {},
                0.1};
    for (auto& direction : whole.direction) direction = some().normalized();
    Vector6 truth;
    truth << some(), some();
    const Matrix3 R = whole.attitude(truth);
    for (int k = 0; k < 2; ++k) whole.y.segment<3>(3 * k) = R.transpose() * whole.direction[k] + 0.1 * some();

    jml::Filter filter{jml::Iterated<jml::Ekf<>>{}, Turning{Q}, jml::Estimate{x0, P}};
    const Pair pair{{whole.direction[0], 0.1}, {whole.direction[1], 0.1}};
    decltype(filter.step(pair, whole.y, 0.5, rate)) report;
    {
      const heap_trap::Armed trap;
      report = filter.step(pair, whole.y, 0.5, rate);
    }
    EXPECT_EQ(heap_trap::allocations, 0);
    ASSERT_TRUE(jml::usable(report.status)) << i << ' ' << jml::describe(report.status);
    iterations += report.iterations;
    Vector6 best = Vector6::Zero();
    double least = whole.descend(best);
    for (int k = 0; k < 15; ++k) {
      Vector6 u;
      for (int j = 0; j < 6; ++j) u(j) = 1.5 * normal(starts);
      const double cost = whole.descend(u);
      if (cost < least) {
        least = cost;
        best = u;
      }
    }
    EXPECT_NEAR(report.cost, least, 1e-8 * (1 + least)) << i;
    EXPECT_LT(oracle::angle_between(oracle::matrix_of(filter.x()), whole.attitude(best).cast<oracle::Real>()),
              1e-5)
        << i;
  }
  figure::print("steps", scenes);
  figure::print("iterations", static_cast<double>(iterations) / scenes);
  EXPECT_LT(iterations, 700 * scenes);
}

/// x⁺ = x exp(w), Q as x̂ says; y = x + v, R as the prediction says.
struct Growth {
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& w) const {
    using std::exp;
    return jml::Vector<T, 1>(x(0) * exp(w(0)));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance(const jml::Vector<double, 1>& x) const {
    return jml::Matrix<double, 1, 1>(0.02 * x(0) * x(0));
  }
};
struct Seen {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance(const jml::Vector<double, 1>& x) const {
    return jml::Matrix<double, 1, 1>(0.01 * x(0) * x(0));
  }
};
const jml::Estimate<double, 1> start{jml::Vector<double, 1>(2.0), jml::Matrix<double, 1, 1>(0.1)};

// Of ½ (x_0 - 2)²/P + ½ w²/Q(2) + ½ (y - x_0 eʷ)²/R(2), by Newton's method from the least of many w with
// their best x_0.
TEST(WideStep, CovariancesAreThoseOfEstimateAndPrediction) {
  constexpr double P = 0.1, Q = 0.08, R = 0.04;
  for (double y = 0.5; y < 5; y += 0.25) {
    const auto best = [&](double w) { return (2 / P + std::exp(w) * y / R) / (1 / P + std::exp(2 * w) / R); };
    const auto cost = [&](double w) {
      const double a = best(w) - 2, off = y - best(w) * std::exp(w);
      return a * a / P + w * w / Q + off * off / R;
    };
    double w = 0;
    for (double other = -3; other < 3; other += 0.01) w = cost(other) < cost(w) ? other : w;
    double x = best(w);
    for (int k = 0; k < 50; ++k) {
      const double e = std::exp(w), off = y - x * e;
      const double g0 = (x - 2) / P - off * e / R, g1 = w / Q - off * x * e / R;
      const double h00 = 1 / P + e * e / R, h01 = (x * e - off) * e / R,
                   h11 = 1 / Q + (x * e - off) * x * e / R, det = h00 * h11 - h01 * h01;
      ASSERT_GT(det, 0);
      x -= (h11 * g0 - h01 * g1) / det;
      w -= (h00 * g1 - h01 * g0) / det;
    }
    jml::Filter filter{jml::Factored{jml::Iterated<jml::Ekf<>>{}}, Growth{}, start};
    const auto report = filter.step(Seen{}, y);
    ASSERT_TRUE(jml::usable(report.status)) << y;
    EXPECT_NEAR(filter.x()(0), x * std::exp(w), 1e-9) << y;
    EXPECT_NEAR(report.smoothed(0), x - 2, 1e-9) << y;
  }
}

// Also of what is many deviations off, and where x_0 = 0 hides that w is not yet what it is to be (y = -7.2):
// its cost is J of its own x_0 and w, and their slope is zero.
TEST(WideStep, ItsAnswerIsAStepOfTheModel) {
  constexpr double P = 0.1, Q = 0.08, R = 0.04;
  for (double y = -30; y < 60; y += 1.2) {
    jml::Filter filter{jml::Factored{jml::Iterated<jml::Ekf<>>{}}, Growth{}, start};
    const auto report = filter.step(Seen{}, y);
    ASSERT_TRUE(jml::usable(report.status)) << y << ' ' << jml::describe(report.status);
    const double x = 2 + report.smoothed(0), w = std::log(filter.x()(0) / x), off = y - filter.x()(0);
    const double J = ((x - 2) * (x - 2) / P + w * w / Q + off * off / R) / 2;
    EXPECT_NEAR(report.cost, J, 1e-8 * (1 + J)) << y;
    EXPECT_NEAR((x - 2) / P, off * std::exp(w) / R, 1e-8 * (1 + std::abs(off) * std::exp(w) / R)) << y;
    EXPECT_NEAR(w / Q, off * filter.x()(0) / R, 1e-8 * (1 + std::abs(off * filter.x()(0)) / R)) << y;
  }
}

// What it lets pass is not judged again about another w.
TEST(WideStep, AGateJudgesOnce) {
  int passed = 0, rejected = 0;
  for (double y = 0.5; y < 5; y += 0.01) {
    jml::Filter gated{jml::Factored{jml::Iterated<jml::Ekf<>>{}}, Growth{}, start}, open = gated;
    gated.gate = {0.9};
    const auto report = gated.step(Seen{}, y);
    ASSERT_TRUE(jml::usable(report.status) && jml::usable(open.step(Seen{}, y).status)) << y;
    if (report.gate == jml::Verdict::rejected) {
      ++rejected;
    } else {
      ++passed;
      EXPECT_EQ(gated.x(), open.x()) << y;
    }
  }
  EXPECT_GT(passed, 100);
  EXPECT_GT(rejected, 100);
}

}  // namespace
