// SPDX-License-Identifier: BSD-3-Clause
// On a linear system the continuous smoother is the Kalman-Bucy smoother in the form of Bryson and Frazier,
// integrated here on its own:
//   x̂˙ = F x̂ + K (y - M x̂),  Ṗ = F P + P Fᵀ + G Q Gᵀ - K R Kᵀ,  K = P Mᵀ R⁻¹;  backward
//   λ̇ = -(F - K M)ᵀ λ - Mᵀ R⁻¹ (y - M x̂),  Λ̇ = -(F - K M)ᵀ Λ - Λ (F - K M) - Mᵀ R⁻¹ M;
//   x = x̂ + P λ,  P_s = P - P Λ P.
#include <gtest/gtest.h>

#include <jml/continuous/swept.hpp>
#include <vector>

namespace {

using namespace jml::operators;

using X = jml::Vector<double, 3>;
using Square = jml::Matrix<double, 3, 3>;
using Y = jml::Vector<double, 2>;

const Square F{{0, 1, 0}, {-2, -0.3, 0.5}, {0.1, 0, -0.4}};
const jml::Matrix<double, 3, 2> G{{0, 0}, {1, 0.2}, {0, 1}};
const jml::Matrix<double, 2, 2> Q{{1.5, 0.4}, {0.4, 0.7}}, R{{0.02, 0.004}, {0.004, 0.05}};
const jml::Matrix<double, 2, 2> R_inverse =
    jml::Matrix<double, 2, 2>{{0.05, -0.004}, {-0.004, 0.02}} / 0.000984;
const jml::Matrix<double, 2, 3> M{{1, 0, 0.3}, {0, 0.5, 1}};

struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 3, disturbances = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x) const {
    return F.cast<T>() * x;
  }
  jml::Matrix<double, 3, 2> disturbance_input() const { return G; }
  jml::Matrix<double, 2, 2> disturbance_spectral_density() const { return Q; }
};
struct Signal {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 3>& x) const {
    return M.cast<T>() * x;
  }
  jml::Matrix<double, 2, 2> noise_spectral_density() const { return R; }
};

Y measured(double t) {
  return {std::sin(2 * t) + 0.3 * std::cos(11 * t), std::exp(-t) - 0.2 * std::sin(7 * t)};
}

struct Point {
  X x;
  Square P;
  Point moved(double by, const Point& slope) const { return {x + by * slope.x, P + by * slope.P}; }
};
template <typename Rate>
Point runge_kutta(const Point& z, double t, double h, const Rate& rate) {
  const Point a = rate(t, z), b = rate(t + h / 2, z.moved(h / 2, a)), c = rate(t + h / 2, z.moved(h / 2, b)),
              d = rate(t + h, z.moved(h, c));
  return {z.x + h / 6 * (a.x + 2 * b.x + 2 * c.x + d.x), z.P + h / 6 * (a.P + 2 * b.P + 2 * c.P + d.P)};
}

TEST(TwoPointLinear, IsTheKalmanBucySmoother) {
  constexpr int steps = 80, parts = 100;  // of 25 ms; the filter is needed at half the steps of the smoother
  constexpr double dt = 0.025, h = dt / parts;
  for (const double prior : {1.0, 0.0}) {
    const Square P0 = prior * Square{{0.5, 0.1, 0}, {0.1, 0.4, -0.1}, {0, -0.1, 0.8}};
    const X x0(0.4, -1, 0.2);
    const Square MRM = M.transpose() * R_inverse * M, GQG = G * Q * G.transpose();
    std::vector<Point> filter{{x0, P0}};
    for (int i = 0; i < 2 * steps * parts; ++i) {
      filter.push_back(runge_kutta(filter.back(), i * h / 2, h / 2, [&](double t, const Point& z) -> Point {
        const jml::Matrix<double, 3, 2> K = z.P * M.transpose() * R_inverse;
        return {F * z.x + K * (measured(t) - M * z.x), F * z.P + z.P * F.transpose() + GQG - z.P * MRM * z.P};
      }));
    }
    std::vector<Point> wanted(steps + 1);
    Point later{X::Zero(), Square::Zero()};
    std::vector<X> costate(steps + 1, X::Zero());
    wanted[steps] = filter.back();
    for (int i = steps * parts; i > 0; --i) {
      later = runge_kutta(later, i * h, -h, [&](double t, const Point& z) -> Point {
        const Point& f = filter[std::size_t(std::lround(2 * t / h))];
        const Square closed = F - f.P * MRM;
        return {-closed.transpose() * z.x - M.transpose() * R_inverse * (measured(t) - M * f.x),
                -closed.transpose() * z.P - z.P * closed - MRM};
      });
      if ((i - 1) % parts == 0) {
        const Point& f = filter[std::size_t(2 * (i - 1))];
        const auto k = std::size_t((i - 1) / parts);
        wanted[k] = {f.x + f.P * later.x, f.P - f.P * later.P * f.P};
        costate[k] = later.x;
      }
    }

    jml::TwoPoint smoother{Plant{}, Signal{}, jml::Estimate<double, 3>{x0, P0}, {.steps = steps}};
    for (int k = 0; k < steps; ++k) ASSERT_EQ(smoother.step(measured, dt), jml::Status::ok);
    const auto report = smoother.solve();
    ASSERT_EQ(report.status, jml::Status::ok);
    const auto expect_wanted = [&] {
      for (int k = 0; k <= steps; ++k) {
        EXPECT_LT((smoother.x(k) - wanted[std::size_t(k)].x).norm(), 1e-9) << k;
        EXPECT_LT((smoother.costate(k) - costate[std::size_t(k)]).norm(), 1e-8) << k;
      }
    };
    expect_wanted();
    int seen = 0;
    EXPECT_TRUE(smoother.covariances([&](int k, const Square& P) {
      EXPECT_LT((P - wanted[std::size_t(k)].P).norm(), 1e-9) << k;
      ++seen;
    }));
    EXPECT_EQ(seen, steps + 1);
    const auto swept = jml::sweep(smoother, jml::Rnls{});
    ASSERT_EQ(swept.status, jml::Status::ok);
    EXPECT_LE(swept.sweeps, 2);
    EXPECT_NEAR(swept.cost, report.cost, 1e-10);
    EXPECT_LT((swept.P - filter.back().P).norm(), 1e-9);
    expect_wanted();
  }
}

}  // namespace
