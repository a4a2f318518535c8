// SPDX-License-Identifier: BSD-3-Clause
// A manifold that folds: behind a hill of |h|² the optimal paths from both sides meet.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/analysis/stability_region.hpp>

#include "models/stability.hpp"

namespace {

using namespace jml::operators;

using V2 = jml::Vector<double, 2>;

/// y = x (1 + 4 exp(-|x - (1, 0)|²/0.18)) + v.
struct Hill {
  static constexpr int measurements = 2;

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    using std::exp;
    const T factor = 1.0 + 4 * exp(-((x(0) - 1.0) * (x(0) - 1.0) + x(1) * x(1)) * (1 / 0.18));
    return {x(0) * factor, x(1) * factor};
  }
  jml::Matrix<double, 2, 2> measurement_sdc(const jml::Vector<double, 2>& x) const {
    return (1 + 4 * std::exp(-((x(0) - 1) * (x(0) - 1) + x(1) * x(1)) / 0.18)) *
           jml::Matrix<double, 2, 2>::Identity();
  }
  jml::Matrix<double, 2, 2> noise_spectral_density() const { return jml::Matrix<double, 2, 2>::Identity(); }
};

/// The lowest level at which a ray meets its neighbour, det[ẋ, δx] = 0: fixed-step Runge-Kutta on ẋ = a x +
/// λ, λ̇ = -a λ + ½ ∂|h|²/∂x, the derivative by hand. a = -0.2, G = Q = R = 1.
double focal_level() {
  using State = jml::Vector<double, 5>;
  const auto motion = [](const State& y) {
    const double x1 = y(0), x2 = y(1);
    const double bump = 4 * std::exp(-((x1 - 1) * (x1 - 1) + x2 * x2) / 0.18), factor = 1 + bump;
    const double square = x1 * x1 + x2 * x2;
    const double g1 = factor * factor * x1 - square * factor * bump * 2 * (x1 - 1) / 0.18;
    const double g2 = factor * factor * x2 - square * factor * bump * 2 * x2 / 0.18;
    State out;
    out << -0.2 * x1 + y(2), -0.2 * x2 + y(3), 0.2 * y(2) + g1, 0.2 * y(3) + g2, 0;
    out(4) = y(2) * out(0) + y(3) * out(1);
    return out;
  };
  const double inverse = 0.2 + std::sqrt(0.04 + std::pow(1 + 4 * std::exp(-1 / 0.18), 2));  // 1/V(0)
  const auto step = [&](const State& y, double h) -> State {
    const State k1 = motion(y), k2 = motion(y + h / 2 * k1), k3 = motion(y + h / 2 * k2),
                k4 = motion(y + h * k3);
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  };
  double lowest = INFINITY;
  for (double angle = 0; angle < 1; angle += 0.01) {
    State y[2];
    for (int i = 0; i < 2; ++i) {
      const double c = 1e-3 * std::cos(angle + 1e-6 * i), s = 1e-3 * std::sin(angle + 1e-6 * i);
      y[i] << c, s, inverse * c, inverse * s, 0.5e-6 * inverse;
    }
    for (int k = 0; k < 8000 && y[0](4) < 10; ++k) {
      for (State& ray : y) ray = step(ray, 2e-3);
      const State going = motion(y[0]), apart = y[1] - y[0];
      if (going(0) * apart(1) - going(1) * apart(0) < 0) lowest = std::min(lowest, y[0](4));
    }
  }
  return lowest;
}

TEST(Fold, EndsTheMarchWhereNeighbouringRaysCross) {
  const models::Copies<2> d{V2(-0.2, -0.2), V2(1, 1)};
  const double wanted = focal_level();
  ASSERT_TRUE(std::isfinite(wanted));
  RecordProperty("focal_level", std::to_string(wanted));
  const auto region = jml::stability_region(
      d, Hill{}, {.box = V2(8, 8), .level_ratio = 1.05, .largest_gap = 0.03, .beyond = 3});
  EXPECT_EQ(region.reach_limit, jml::StabilityLimit::fold);
  EXPECT_LT(region.reach, 1.1 * wanted);  // the fold shows one level and one gap late
  EXPECT_GT(region.reach, wanted / 1.05);
  EXPECT_LE(region.level, region.reach);
}

}  // namespace
