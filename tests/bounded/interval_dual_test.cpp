// SPDX-License-Identifier: BSD-3-Clause
// Dual numbers of intervals: over a box they enclose a model's values and its Jacobian at every point.
#include <gtest/gtest.h>

#include <jml/model/functions.hpp>
#include <jml/bounded/interval_functions.hpp>

#include "models/bare.hpp"
#include "models/pendulum.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"
#include "random_intervals.hpp"

namespace {

using namespace jml::operators;

using I = jml::Interval<double>;
template <int n>
using Slope = jml::Dual<I, n>;

const jml::StepContext<double> at{};

/// Over random boxes about `centre`: values and Jacobians in long double at points of the box are inside, and
/// the hand-written Jacobian to its rounding; over a small box the enclosure is not much wider than the
/// Jacobian's change across it.
template <int rows, int n, typename Function, typename Jacobian>
void check_model(const jml::Vector<double, n>& centre, const jml::Vector<double, n>& size,
                 const Function& function, const Jacobian& by_hand) {
  RandomIntervals<double> random{jml::Noise(1)};
  int outside = 0, outside_by_hand = 0, outside_value = 0;
  for (int run = 0; run < 2000; ++run) {
    const double scale = std::exp2(random.noise.uniform(-20, 0));
    jml::Vector<I, n> box;
    for (int i = 0; i < n; ++i) {
      const double middle = centre(i) + size(i) * random.noise.uniform(-1, 1),
                   radius = scale * size(i) * random.noise.uniform();
      box(i) = {middle - radius, middle + radius};
    }
    const jml::Vector<I, rows> values = function(box);
    const jml::Matrix<I, rows, n> J = jml::derive_jacobian<rows>(function, box);
    for (int point = 0; point < 5; ++point) {
      jml::Vector<double, n> x;
      for (int i = 0; i < n; ++i) x(i) = random.inside(box(i));
      const jml::Vector<long double, n> X = x.template cast<long double>();
      const jml::Vector<long double, rows> value = function(X);
      const jml::Matrix<long double, rows, n> exact = jml::derive_jacobian<rows>(function, X);
      const jml::Matrix<double, rows, n> hand = by_hand(x);
      for (int i = 0; i < rows; ++i) {
        outside_value += !encloses(values(i), value(i));
        for (int j = 0; j < n; ++j) {
          outside += !encloses(J(i, j), exact(i, j));
          outside_by_hand += !encloses(J(i, j) + I(-1, 1) * (1e-14 * std::abs(hand(i, j))), hand(i, j));
        }
      }
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(outside_by_hand, 0);
  EXPECT_EQ(outside_value, 0);
}

TEST(IntervalDual, VanDerPol) {
  const models::VanDerPol model{};
  check_model<2, 2>(
      {0.5, -0.5}, {2, 2}, [&](const auto& x) { return model.dynamics(x); },
      [&](const auto& x) { return model.dynamics_jacobian(x); });
  const models::SaturatingPosition sensor{};
  check_model<1, 2>(
      {0.5, -0.5}, {2, 2}, [&](const auto& x) { return sensor.measurement(x); },
      [&](const auto& x) { return sensor.measurement_jacobian(x); });
}
TEST(IntervalDual, Pendulum) {
  const models::Pendulum model{};
  check_model<2, 2>(
      {0, 0}, {4, 5}, [&](const auto& x) { return model.dynamics(x); },
      [&](const auto& x) { return model.dynamics_jacobian(x); });
}
TEST(IntervalDual, RangeAndAngles) {
  const models::Radar sensor{};
  jml::Vector<double, 6> centre, size;
  centre << -20, 6, 8, 1, 1, 1;
  size << 3, 2, 3, 1, 1, 1;
  check_model<3, 6>(
      centre, size, [&](const auto& x) { return sensor.measurement(x); },
      [&](const auto& x) { return sensor.measurement_jacobian(x); });
}

// Van der Pol by hand over [1, 1.1] × [-0.5, -0.4], dt = 1/16, c = 1/4, k = 1:
// J = [1, dt; -dt (1 + x v), 1 - dt (x² - 1)/2]; constant entries are exact.
TEST(IntervalDual, JacobianOfVanDerPolByHand) {
  const models::VanDerPol model{.dt = 0.0625, .c = 0.25};
  const jml::Vector<I, 2> box(I(1, 1.1), I(-0.5, -0.4));
  const jml::Matrix<I, 2, 2> J = jml::dynamics_jacobian(models::Bare<models::VanDerPol>{model}, box, at);
  EXPECT_TRUE(J(0, 0).low == 1 && J(0, 0).high == 1 && J(0, 1).contains(0.0625) && J(0, 1).width() < 1e-16);
  const auto near = [](const I& a, double low, double high) {
    EXPECT_NEAR(a.low, low, 1e-15);
    EXPECT_NEAR(a.high, high, 1e-15);
    EXPECT_TRUE(a.contains(I(low + 1e-15, high - 1e-15)));
  };
  near(J(1, 0), -0.0625 * (1 - 0.4), -0.0625 * (1 - 0.55));
  near(J(1, 1), 1 - 0.0625 * (1.1 * 1.1 - 1) / 2, 1);
}

/// f over random intervals, its slope against `derivative` in long double.
template <typename F, typename Derivative>
void check_slope(double low, double high, const F& f, const Derivative& derivative) {
  RandomIntervals<double> random{jml::Noise(2)};
  int outside = 0;
  double worst = 0;
  for (int k = 0; k < 5000; ++k) {
    Slope<2> a(random.within(low, high));
    a.partial[0] = 1;
    const I slope = f(a).partial[0];
    EXPECT_TRUE(is_zero(f(a).partial[1]));
    for (int i = 0; i < 3; ++i) {
      const long double exact = derivative(static_cast<long double>(random.inside(a.value)));
      if (std::isfinite(exact)) outside += !encloses(slope, exact);
    }
    if (a.value.low == a.value.high && a.value.low != 0) {
      const long double exact = derivative(static_cast<long double>(a.value.low));
      const double unit = std::numeric_limits<double>::epsilon() * (1 + static_cast<double>(std::abs(exact)));
      if (std::isfinite(exact)) worst = std::max(worst, slope.width() / unit);
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_LT(worst, 100);
}

TEST(IntervalDual, SlopesOfTheFunctions) {
  using std::sqrt;
  constexpr long double pi = 3.14159265358979323846264338327950288L,
                        ln10 = 2.30258509299404568401799145468436421L;
  check_slope(-5, 5, [](const auto& x) { return sin(x); }, [](long double x) { return std::cos(x); });
  check_slope(-5, 5, [](const auto& x) { return cos(x); }, [](long double x) { return -std::sin(x); });
  check_slope(
      -1.5, 1.5, [](const auto& x) { return tan(x); },
      [](long double x) { return 1 / (std::cos(x) * std::cos(x)); });
  check_slope(
      -0.9, 0.9, [](const auto& x) { return asin(x); },
      [](long double x) { return 1 / std::sqrt(1 - x * x); });
  check_slope(
      -0.9, 0.9, [](const auto& x) { return acos(x); },
      [](long double x) { return -1 / std::sqrt(1 - x * x); });
  check_slope(-5, 5, [](const auto& x) { return atan(x); }, [](long double x) { return 1 / (1 + x * x); });
  check_slope(-5, 5, [](const auto& x) { return sinh(x); }, [](long double x) { return std::cosh(x); });
  check_slope(-5, 5, [](const auto& x) { return cosh(x); }, [](long double x) { return std::sinh(x); });
  check_slope(
      -2, 2, [](const auto& x) { return tanh(x); },
      [](long double x) { return 1 / (std::cosh(x) * std::cosh(x)); });
  check_slope(
      -5, 5, [](const auto& x) { return asinh(x); }, [](long double x) { return 1 / std::sqrt(1 + x * x); });
  check_slope(-5, 5, [](const auto& x) { return exp(x); }, [](long double x) { return std::exp(x); });
  check_slope(-1, 5, [](const auto& x) { return expm1(x); }, [](long double x) { return std::exp(x); });
  check_slope(0.1, 5, [](const auto& x) { return log(x); }, [](long double x) { return 1 / x; });
  check_slope(0.1, 5, [](const auto& x) { return log10(x); }, [](long double x) { return 1 / (x * ln10); });
  check_slope(-0.9, 5, [](const auto& x) { return log1p(x); }, [](long double x) { return 1 / (1 + x); });
  check_slope(
      -3, 3, [](const auto& x) { return erf(x); },
      [](long double x) { return 2 / std::sqrt(pi) * std::exp(-x * x); });
  check_slope(
      0, 5, [](const auto& x) { return sqrt(x); }, [](long double x) { return 1 / (2 * std::sqrt(x)); });
  check_slope(
      -5, 5, [](const auto& x) { return cbrt(x); },
      [](long double x) { return 1 / (3 * std::cbrt(x) * std::cbrt(x)); });
  check_slope(
      -5, 5, [](const auto& x) { return abs(x); }, [](long double x) { return x < 0 ? -1.0L : 1.0L; });
  check_slope(
      -5, 5, [](const auto& x) { return fabs(x) + max(x, 1.0) - min(x, 2.0); },
      [](long double x) { return (x < 0 ? -1.0L : 1.0L) + (x > 1 ? 1 : 0) - (x < 2 ? 1 : 0); });
  check_slope(-5, 5, [](const auto& x) { return pow(x, 2); }, [](long double x) { return 2 * x; });
  check_slope(
      -5, 5, [](const auto& x) { return pow(x, 3.0) + pow(x, 0); }, [](long double x) { return 3 * x * x; });
  check_slope(
      0, 5, [](const auto& x) { return pow(x, 0.1); },
      [](long double x) { return 0.1 * std::pow(x, 0.1 - 1.0L); });
  check_slope(
      0.1, 5, [](const auto& x) { return pow(x, x); },
      [](long double x) { return std::pow(x, x) * (std::log(x) + 1); });
  check_slope(
      -5, 5, [](const auto& x) { return pow(2.0, x); },
      [](long double x) { return std::pow(2.0L, x) * std::log(2.0L); });
  check_slope(
      -5, 5, [](const auto& x) { return hypot(x, 0.5); },
      [](long double x) { return x / std::hypot(x, 0.5L); });
  check_slope(
      -5, 5, [](const auto& x) { return atan2(x, 0.5); },
      [](long double x) { return 0.5L / (x * x + 0.25L); });
  check_slope(
      -5, 5, [](const auto& x) { return (x + 1.0) / (x * x + 3.0); },
      [](long double x) { return (3 - 2 * x - x * x) / ((x * x + 3) * (x * x + 3)); });
}

// What no derivative tells at a kink, the mean value does: f(y) - f(x) = s (y - x) for a slope s inside.
TEST(IntervalDual, SlopesAcrossAKink) {
  RandomIntervals<double> random{jml::Noise(3)};
  const auto f = [](const auto& x, const auto& y) {
    using std::abs, std::max, std::min, std::hypot;
    return abs(x) + 2.0 * max(x, y) - 0.5 * min(x - 0.25, 3.0 * y) + hypot(x, y);
  };
  for (int k = 0; k < 20000; ++k) {
    const I box[2] = {random.within(-1, 1), random.within(-1, 1)};
    Slope<2> x(box[0]), y(box[1]);
    x.partial[0] = y.partial[1] = 1;
    const Slope<2> value = f(x, y);
    const long double u[2] = {random.inside(box[0]), random.inside(box[1])},
                      v[2] = {random.inside(box[0]), random.inside(box[1])};
    const I bound = value.partial[0] * I(v[0] - u[0]) + value.partial[1] * I(v[1] - u[1]);
    const long double change = f(v[0], v[1]) - f(u[0], u[1]);
    ASSERT_TRUE(encloses(bound + I(-1e-18, 1e-18), change));  // of the long double itself
    ASSERT_TRUE(isfinite(value.partial[0]) && isfinite(value.partial[1]));
    ASSERT_TRUE(encloses(value.value, f(u[0], u[1])));
  }
}

TEST(IntervalDual, AtKinksAndPoles) {
  Slope<1> x(I(-1, 2));
  x.partial[0] = 1;
  EXPECT_TRUE(abs(x).partial[0].low == -1 && abs(x).partial[0].high == 1 && abs(x).value.low == 0);
  EXPECT_TRUE(abs(x + 2.0).partial[0].low == 1 && abs(x - 3.0).partial[0].high == -1);
  EXPECT_TRUE(max(x, 5.0).partial[0].high == 0 && max(x, -5.0).partial[0].low == 1);
  EXPECT_TRUE(max(x, 0.0).partial[0].low == 0 && max(x, 0.0).partial[0].high == 1);
  EXPECT_TRUE(min(x, 5.0).partial[0].low == 1 && min(x, 0.0).partial[0].low == 0);
  EXPECT_TRUE(hypot(x, x).partial[0].contains(I(-1.5, 1.5)) && hypot(x, x).partial[0].width() < 4.001);
  EXPECT_TRUE((x * x).value.low == 0 && (x * x).partial[0].contains(I(-2, 4)) &&
              (x * x).partial[0].width() < 6.001);
  EXPECT_TRUE(atan(x).partial[0].contains(I(0.2, 1)) && atan(x).partial[0].width() < 0.8001);
  EXPECT_TRUE(pow(x, 2).value.low == 0 && pow(x, 3).partial[0].low == 0);
  EXPECT_FALSE(isfinite(sqrt(x).partial[0]) || isfinite(cbrt(x).partial[0]) ||
               isfinite((1.0 / x).partial[0]));
  EXPECT_FALSE(isnan(sqrt(x).partial[0]) || isnan(cbrt(x).partial[0]) || isnan((1.0 / x).partial[0]));
  EXPECT_TRUE(isnan(log(x - 5.0)) && !isfinite(1.0 / x));
}

TEST(IntervalDual, InEigen) {
  const jml::Vector<Slope<2>, 2> x = jml::seed(jml::Vector<I, 2>(I(-1, 2), I(3, 5)));
  jml::Matrix<double, 2, 2> F;
  F << 1, -2, 0.5, 4;
  const jml::Vector<Slope<2>, 2> y = F * x, z = F.cast<Slope<2>>() * x + 0.5 * x;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      EXPECT_TRUE(y(i).partial[j].contains(F(i, j)) && y(i).partial[j].width() < 1e-14);
      EXPECT_TRUE(z(i).partial[j].contains(F(i, j) + (i == j ? 0.5 : 0)));
    }
  }
  EXPECT_TRUE(y(0).value.contains(I(-11, -4)));
}

}  // namespace
