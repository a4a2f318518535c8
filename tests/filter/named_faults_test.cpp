// SPDX-License-Identifier: BSD-3-Clause
// Inputs that were once answered wrong, or refused by the wrong name, each by its numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/iterated/iterated.hpp>
#include <limits>

namespace {

using jml::Status;
template <int n>
using Vec = jml::Vector<double, n>;
template <int rows, int cols>
using Mat = jml::Matrix<double, rows, cols>;

double wrap(double angle) { return std::remainder(angle, 2 * 3.14159265358979323846); }

/// An angle and its rate.
struct Turning {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 2>(x(0) + 0.1 * x(1), x(1));
  }
  Mat<2, 2> disturbance_input() const { return Mat<2, 2>::Identity(); }
  Mat<2, 2> disturbance_covariance() const {
    Mat<2, 2> Q;
    Q << 1e-4, 0, 0, 1e-3;
    return Q;
  }
};
template <bool says_linear>
struct Angle {
  static constexpr int measurements = 1;
  static constexpr bool linear = says_linear;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const {
    using std::floor;
    constexpr double turn = 2 * 3.14159265358979323846;
    const T difference = y(0) - predicted(0);
    return jml::Vector<T, 1>(difference - turn * std::round(jml::plain_value(difference) / turn));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(0.01); }
};

// S8: an angle that turns past π. A residual of angles, where x and the origin are far apart, is no
// difference of m: the gains of derived SDC matrices changed their sign there.
template <bool says_linear, typename Rule>
double last_angle(const Rule& rule) {
  Mat<2, 2> P;
  P << 0.01, 0, 0, 0.04;
  jml::Filter filter{rule, Turning{}, jml::Estimate<double, 2>{Vec<2>(3, 0.8), P}};
  for (int k = 1; k <= 60; ++k)
    EXPECT_TRUE(
        jml::usable(filter.step(Angle<says_linear>{}, wrap(3 + 0.08 * k + 0.02 * std::sin(7.0 * k))).status))
        << k;
  return filter.x()(0);
}
TEST(NamedFaults, S8AnAngleTurnsPastPi) {
  constexpr double right = 7.793307107;
  EXPECT_NEAR((last_angle<true>(jml::Ekf{})), right, 1e-8);
  EXPECT_NEAR((last_angle<true>(jml::Sddre{})), right, 1e-8);
  EXPECT_NEAR((last_angle<true>(jml::Jml{})), right, 1e-8);
  EXPECT_NEAR((last_angle<true>(jml::IteratedJml{})), right, 1e-8);
  EXPECT_NEAR((last_angle<false>(jml::Sddre{})), right, 1e-8);
  EXPECT_NEAR((last_angle<false>(jml::Jml{})), right, 1e-8);
  EXPECT_NEAR((last_angle<false>(jml::IteratedJml{})), right, 1e-8);
}

struct VanDerPol {
  static constexpr int states = 2, disturbances = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 2>(x(0) + 0.1 * x(1), x(1) + 0.1 * ((1.0 - x(0) * x(0)) * x(1) - x(0)));
  }
  Mat<2, 2> disturbance_covariance() const { return 1e-4 * Mat<2, 2>::Identity(); }
};
/// |x_0|, of which no residual can be negative.
struct Size {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(jml::plain_value(x(0)) < 0 ? T(-x(0)) : T(x(0)));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(1e-12); }
};
// S13: what a window refuses leaves it bit for bit as it was.
TEST(NamedFaults, S13ARefusalLeavesTheWindow) {
  int refused = 0;
  for (const double y : {-0.2, -1.0, -5.0, std::numeric_limits<double>::quiet_NaN()}) {
    for (const double x0 : {0.003, 0.5, -0.01}) {
      jml::Filter lag{jml::FixedLag<5>{{.sweeps = 30}}, VanDerPol{}, jml::Sensors<Size>{},
                      jml::Estimate<double, 2>{Vec<2>(x0, 0.2), 0.1 * Mat<2, 2>::Identity()}};
      for (int k = 0; k < 7; ++k) {
        const Vec<2> x = lag.x(), older = lag.x(lag.belief().depth());
        const Mat<2, 2> P = lag.P();
        const double time = lag.time();
        const auto report = lag.step(Size{}, y, 0.1);
        if (jml::usable(report.status)) continue;
        ++refused;
        EXPECT_EQ(lag.x(), x);
        EXPECT_EQ(lag.x(lag.belief().depth()), older);
        EXPECT_EQ(lag.P(), P);
        EXPECT_EQ(lag.time(), time);
      }
    }
  }
  std::printf("%d refusals\n", refused);
  EXPECT_GT(refused, 20);
}

/// Says nothing that is a number.
struct Broken : Size {
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) * std::numeric_limits<double>::quiet_NaN());
  }
};
// S16: one bad record is refused where it comes.
TEST(NamedFaults, S16ABatchTakesNoBadRecord) {
  jml::Batch batch{VanDerPol{},
                   jml::Sensors<Size, Broken>{},
                   jml::Estimate<double, 2>{Vec<2>(1, 0), Mat<2, 2>(Mat<2, 2>::Identity())},
                   {.steps = 3, .measurements = 3}};
  EXPECT_EQ(batch.step(Broken{}, 1.0, 0.1).status, Status::sensor_not_finite);
  EXPECT_EQ(batch.steps(), 0);
  EXPECT_EQ(batch.step(Size{}, 1.0, 0.1).status, Status::ok);
  EXPECT_EQ(batch.update(Broken{}, 1.0).status, Status::sensor_not_finite);
  EXPECT_TRUE(jml::usable(batch.solve().status));
}

// S19: a check is no sum that overflows.
TEST(NamedFaults, S19Overflow) {
  constexpr double large = 1e308;
  Mat<2, 2> P = Mat<2, 2>::Identity();
  P(1, 1) = -large;
  jml::Filter negative{jml::Ekf{}, VanDerPol{}, jml::Estimate<double, 2>{Vec<2>(1, 0), P}};
  EXPECT_EQ(negative.status(), Status::invalid_covariance);
  const jml::Estimate<double, 2> one{Vec<2>(1, 0), Mat<2, 2>(Mat<2, 2>::Identity())};
  jml::Filter late{jml::Ekf{}, VanDerPol{}, one, large};
  EXPECT_EQ(late.predict(1.5 * large), Status::invalid_time_step);
  EXPECT_EQ(late.time(), large);
  const auto report = late.update(Size{}, -1.7 * large);
  EXPECT_TRUE(!jml::usable(report.status) ||
              (jml::all_finite(late.x()) && std::isfinite(report.innovation(0))))
      << jml::describe(report.status);
}

}  // namespace
