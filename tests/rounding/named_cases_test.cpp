// SPDX-License-Identifier: BSD-3-Clause
// The cases that the plain form was known to get wrong, each by its numbers: a prior far above the noise, a
// long coast, a sum that is known before it moves, and two rows that are nearly one.
#include <gtest/gtest.h>

#include <jml/filter/way_out.hpp>

#include "rounding/contestants.hpp"

namespace {

using namespace jml::operators;
using namespace rounding;

using jml::Status;
template <typename Scalar, int rows, int cols>
using Matrix = jml::Matrix<Scalar, rows, cols>;

/// x⁺ = F x without disturbance.
template <typename Scalar, int n>
struct Drift {
  static constexpr int states = n, disturbances = 0;
  static constexpr bool linear = true;
  Matrix<Scalar, n, n> F = Matrix<Scalar, n, n>::Identity();
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return F.template cast<T>() * x;
  }
};

/// use(method): the plain form, and the factored one.
template <typename Use>
void with_each_form(const Use& use) {
  {
    SCOPED_TRACE("plain");
    use(jml::Kalman{});
  }
#if JML_TEST_FACTORED
  {
    SCOPED_TRACE("factored");
    use(jml::Factored{jml::Kalman{}});
  }
#endif
}
template <typename Method>
inline constexpr bool is_factored = !std::is_same_v<Method, jml::Kalman>;

template <int n, int p>
void measure(Moments& exact, const Sensor<double, n, p>& sensor, const jml::Vector<double, p>& y) {
  std::array<double, n * p> H;
  std::array<double, p * p> R;
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < n; ++j) H[i * n + j] = sensor.H(i, j);
    for (int j = 0; j < p; ++j) R[i * p + j] = sensor.R(i, j);
  }
  for (const ExactRow& row : independent_rows(H.data(), R.data(), y.data(), p, n)) exact.measure(row, 0);
}

template <typename Scalar>
void expect_mean_of_four(Scalar p0, Scalar r) {
  with_each_form([&](auto method) {
    jml::Filter filter{method, Drift<Scalar, 1>{}, jml::Estimate<Scalar, 1>{Scalar(0), p0}};
    const Sensor<Scalar, 1, 1> x{Matrix<Scalar, 1, 1>(1), Matrix<Scalar, 1, 1>(r)};
    for (const int y : {10, 11, 12, 13})
      ASSERT_TRUE(jml::usable(filter.step(x, static_cast<Scalar>(y)).status));
    EXPECT_NEAR(static_cast<double>(filter.x()(0)), 11.5, 1e-5);
    EXPECT_NEAR(static_cast<double>(filter.P()(0, 0) / r), 0.25, 1e-6);
  });
}
TEST(NamedCases, PriorFarAboveTheNoise) { expect_mean_of_four(1e12, 1e-6); }
TEST(NamedCases, PriorFarAboveTheNoiseInFloat) { expect_mean_of_four(1e8F, 1.0F); }

TEST(NamedCases, LongCoast) {
  with_each_form([](auto method) {
    Drift<double, 2> drift;
    drift.F << 1, 0.1, 0, 1;
    jml::Filter filter{
        method, drift,
        jml::Estimate<double, 2>{jml::Vector<double, 2>(0, 0), 1e6 * Matrix<double, 2, 2>::Identity()}};
    for (int k = 0; k < 49; ++k) ASSERT_EQ(filter.predict(), Status::ok);
    const Sensor<double, 2, 1> position{Matrix<double, 1, 2>(1, 0), Matrix<double, 1, 1>(1e-14)};
    ASSERT_TRUE(jml::usable(filter.step(position, 1.0).status));
    EXPECT_NEAR(filter.P()(0, 0) / 1e-14, 1, 1e-3);
    EXPECT_NEAR(filter.P()(1, 1) / (1e6 / 26), 1, 1e-6);
    EXPECT_NEAR(filter.x()(0), 1, 1e-12);
    EXPECT_NEAR(filter.x()(1), 5.0 / 26, 1e-12);
  });
}

TEST(NamedCases, KnownSumMoves) {
  with_each_form([](auto method) {
    Drift<double, 2> drift;
    drift.F << 1, 1, 0, 1;
    Matrix<double, 2, 2> P;
    P << 1, 0.3, 0.3, 3;
    jml::Filter filter{method, drift, jml::Estimate<double, 2>{jml::Vector<double, 2>(0, 0), P}};
    const Sensor<double, 2, 1> sum{Matrix<double, 1, 2>(1, 1), Matrix<double, 1, 1>(1e-16)};
    const Status first = filter.update(sum, 0.0).status;
    if constexpr (is_factored<decltype(method)>) {
      ASSERT_EQ(first, Status::ok);
    }
    if (!jml::usable(first)) return;
    const Status second = filter.predict();
    if constexpr (is_factored<decltype(method)>) {
      ASSERT_EQ(second, Status::ok);
    }
    if (!jml::usable(second)) return;
    EXPECT_NEAR(filter.P()(0, 0) / 1e-16, 1, 1e-3);  // of the sum; x_1 has 2.91/4.6 of its own
    EXPECT_NEAR(filter.P()(1, 1), 2.91 / 4.6, 1e-12);
  });
}

/// (1 1 1) and (1 1 1+d).
template <int p>
Sensor<double, 3, p> rows_of(double d, int first) {
  Sensor<double, 3, p> out;
  for (int i = 0; i < p; ++i) {
    out.H.row(i) << 1, 1, (first + i) % 2 == 1 ? 1 + d : 1;
  }
  out.R = d * d * Matrix<double, p, p>::Identity();
  return out;
}
Moments of_identity(int n) {
  Moments exact;
  exact.n = n;
  for (int i = 0; i < n; ++i) exact.S[i][i] = 1;
  return exact;
}

// Twenty updates by the two rows in turn: right to the bounds after each, or refused (the factored form:
// never).
TEST(NamedCases, TwoRowsThatAreNearlyOne) {
  for (const double d : {1e-8, 1e-9}) {
    with_each_form([d](auto method) {
      using Method = decltype(method);
      const Bounds bounds = is_factored<Method> ? factored_bounds : dense_bounds;
      int refused = 0;
      for (std::uint64_t run = 0; run < 300; ++run) {
        Random random(23, run);
        jml::Vector<double, 3> start;
        QuadVector truth{};
        Moments exact = of_identity(3);
        for (int i = 0; i < 3; ++i) {
          start(i) = random.normal();
          exact.x[i] = start(i);
          truth[i] = start(i) + random.normal();
        }
        jml::Filter filter{method, Drift<double, 3>{},
                           jml::Estimate<double, 3>{start, Matrix<double, 3, 3>::Identity()}};
        for (int k = 0; k < 20; ++k) {
          const auto sensor = rows_of<1>(d, k);
          Quad y = d * random.normal();
          for (int i = 0; i < 3; ++i) y += sensor.H(0, i) * truth[i];
          const jml::Vector<double, 1> number(static_cast<double>(y));
          measure(exact, sensor, number);
          if (!jml::usable(filter.update(sensor, number).status)) {
            ++refused;
            break;
          }
          const double error = covariance_error(shown(filter.belief()).P, exact.P(), exact);
          ASSERT_LE(error, bounds.P) << "d = " << d << ", run " << run << ", update " << k;
        }
      }
      if (is_factored<Method>) {
        EXPECT_EQ(refused, 0);
      }
      std::printf("%s, d = %g: %d of 300 flights refused\n", is_factored<Method> ? "factored" : "plain", d,
                  refused);
    });
  }
}

// Of two updates as d → 0, by hand.
TEST(NamedCases, TwoRowsInTheLimit) {
  Matrix<double, 3, 3> limit;
  limit << 5, -3, -2, -3, 5, -2, -2, -2, 4;
  limit = limit / 8.0;
  for (const double d : {1e-7, 1e-8, 1e-9}) {
    Moments exact = of_identity(3);
    for (int k = 0; k < 2; ++k) measure<3, 1>(exact, rows_of<1>(d, k), jml::Vector<double, 1>(0.0));
    const QuadMatrix P = exact.P();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(static_cast<double>(P[i][j]), limit(i, j), 2 * d + 1e-16 / d);  // 1 + d is rounded
    }
    with_each_form([&](auto method) {
      jml::Filter filter{
          method, Drift<double, 3>{},
          jml::Estimate<double, 3>{jml::Vector<double, 3>(0, 0, 0), Matrix<double, 3, 3>::Identity()}};
      for (int k = 0; k < 2; ++k) {
        const Status status = filter.update(rows_of<1>(d, k), 0.0).status;
        if constexpr (is_factored<decltype(method)>) {
          ASSERT_EQ(status, Status::ok);
        }
        if (!jml::usable(status)) return;
      }
      EXPECT_LT((filter.P() - limit).cwiseAbs().maxCoeff(), 1e-6) << "d = " << d;
    });
  }
}

#if JML_TEST_FACTORED
/// Relative, of the Frobenius norm, and the flight of `updates` calls of p rows each.
template <int p>
double distance_after(double d) {
  Moments exact = of_identity(3);
  jml::Filter filter{
      jml::Factored{jml::Kalman{}}, Drift<double, 3>{},
      jml::Estimate<double, 3>{jml::Vector<double, 3>(0, 0, 0), Matrix<double, 3, 3>::Identity()}};
  for (int k = 0; k < 2; k += p) {
    const auto sensor = rows_of<p>(d, k);
    const jml::Vector<double, p> y = jml::Vector<double, p>::Zero();
    measure(exact, sensor, y);
    EXPECT_EQ(filter.update(sensor, y).status, Status::ok) << "d = " << d;
  }
  const QuadMatrix P = exact.P(), given = shown(filter.belief()).P;
  Quad off = 0, all = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      off += (given[i][j] - P[i][j]) * (given[i][j] - P[i][j]);
      all += P[i][j] * P[i][j];
    }
  }
  return static_cast<double>(sqrtq(off / all));
}
// Two rows whose difference, of 1e-4 to 1e-12, is all that tells the third state: together and one by one.
TEST(NamedCases, FactoredHoldsNearlyParallelRows) {
  Random random(29, 0);
  double together = 0, apart = 0;
  for (int run = 0; run < 200; ++run) {
    const double d = random.decade(-12, -4);
    together = std::max(together, distance_after<2>(d));
    apart = std::max(apart, distance_after<1>(d));
  }
  std::printf("largest relative error of P: together %.1e, apart %.1e\n", together, apart);
  EXPECT_LT(together, 1e-8);
  EXPECT_LT(apart, 1e-8);
}
#endif

// P = [1, 1 - d; 1 - d, 1] has a condition of 2/d. Moved by I it is the same numbers, which a matrix holds;
// moved by 1/3 it is not, and of its least direction (1, -1) what rounding leaves decides.
TEST(NamedCases, PlainIsLostWhereRoundingLosesIt) {
  int held = 0, lost = 0;
  for (int power = 36; power <= 46; ++power) {
    SCOPED_TRACE(power);
    const double near = 1 - std::ldexp(1, -power);
    Drift<double, 2> drift;
    Matrix<double, 2, 2> P;
    P << 1, near, near, 1;
    const jml::Estimate<double, 2> start{jml::Vector<double, 2>(1, 1), P};
    jml::Filter same{jml::Kalman{}, drift, start};
    EXPECT_EQ(same.predict(), Status::ok);
    EXPECT_EQ(same.P(), P);

    const double third = 1.0 / 3;
    drift.F *= third;
    jml::Filter moved{jml::Kalman{}, drift, start};
    const Status status = moved.predict();
    const Quad one = Quad(third) * third, other = one * near;
    const Quad least = one - other, rounded = Quad(static_cast<double>(one)) - static_cast<double>(other);
    const double error = static_cast<double>(fabsq(rounded - least) / least);
    if (error > 8e-4) {
      ++lost;
      EXPECT_EQ(status, Status::covariance_lost) << error;
    } else if (error < 7e-4) {  // of the other directions nothing is lost
      ++held;
      EXPECT_EQ(status, Status::ok) << error;
      EXPECT_NEAR(moved.P()(0, 0) - moved.P()(0, 1), static_cast<double>(least),
                  1e-3 * static_cast<double>(least));
    }
  }
  EXPECT_GT(held, 3);
  EXPECT_GT(lost, 1);
}

// Two states known exactly, constants at first, and then moved by an F that expands by 1.39: x is right to 64
// ε of the largest state, though it contracts for nine steps.
TEST(NamedCases, KnownConstantsThatMoveLater) {
  with_each_form([](auto method) {
    Drift<double, 2> drift;
    const jml::Vector<double, 2> start(0.48697099869198546, 0.62258772811068952);
    jml::Filter filter{method, drift, jml::Estimate<double, 2>{start, Matrix<double, 2, 2>::Zero()}};
    for (int k = 0; k < 3; ++k) ASSERT_EQ(filter.predict(), Status::ok);
    EXPECT_EQ(filter.x(), start);
    EXPECT_FALSE(filter.belief().extended);  // a constant has nothing to keep
    drift.F << -0.34915291480633587, 0.010071245666039782, 1.3351556973178216, -1.3776738613890991;
    ASSERT_EQ(filter.retune(drift), Status::ok);
    Quad x[2] = {start(0), start(1)};
    double largest = 0;
    for (int k = 0; k < 25; ++k) {
      ASSERT_EQ(filter.predict(), Status::ok);
      const Quad first = drift.F(0, 0) * x[0] + drift.F(0, 1) * x[1];
      x[1] = drift.F(1, 0) * x[0] + drift.F(1, 1) * x[1];
      x[0] = first;
      for (int i = 0; i < 2; ++i) {
        largest = std::max(largest, std::abs(static_cast<double>(x[i])));
        EXPECT_LE(std::abs(static_cast<double>(filter.x()(i) - x[i])), std::ldexp(1, -46) * largest) << k;
      }
    }
  });
}

// x⁺ = 2 x_0 + 3.1 x_1, λ x_1 from the direction that λ alone moves: x_0 stays small while 2^k makes more of
// whatever was rounded. λ is of 26 digits, so that its powers are not doubles.
constexpr double contracting = 1 - 12345679 * 0x1p-26;
Drift<double, 2> saddle() {
  Drift<double, 2> drift;
  drift.F << 2, 3.1, 0, contracting;
  return drift;
}
const jml::Vector<double, 2> on_the_saddle(-3.1 / (2 - contracting), 1);

// A reset filter is a new one: what the x before it lacked is forgotten.
TEST(NamedCases, AResetForgetsTheDigitsOfBefore) {
  with_each_form([](auto method) {
    const jml::Estimate<double, 2> far{1e9 * on_the_saddle, Matrix<double, 2, 2>::Zero()};
    const jml::Estimate<double, 2> near{1e-3 * on_the_saddle, Matrix<double, 2, 2>::Zero()};
    jml::Filter filter{method, saddle(), far}, fresh{method, saddle(), near};
    for (int k = 0; k < 7; ++k) ASSERT_EQ(filter.predict(), Status::ok);
    ASSERT_EQ(filter.reset(near, 0), Status::ok);
    for (int k = 0; k < 20; ++k) {
      ASSERT_EQ(filter.predict(), fresh.predict());
      EXPECT_EQ(filter.x(), fresh.x()) << k;
    }
  });
}

// Larger variances, even by nothing, a state's variance given anew as next to nothing: x keeps what it has.
TEST(NamedCases, AWayOutKeepsTheDigitsOfKnownStates) {
  with_each_form([](auto method) {
    for (const int way : {0, 1, 2, 3}) {
      jml::Filter filter{method, saddle(),
                         jml::Estimate<double, 2>{on_the_saddle, Matrix<double, 2, 2>::Zero()}};
      Quad x[2] = {on_the_saddle(0), on_the_saddle(1)};
      for (int k = 0; k < 45; ++k) {
        ASSERT_EQ(filter.predict(), Status::ok);
        x[0] = 2 * x[0] + 3.1 * x[1];
        x[1] = contracting * x[1];
        if (k == 10 && way == 1) {
          ASSERT_EQ(filter.inflate({0, 0}), Status::ok);
        }
        if (k == 10 && way == 2) {
          ASSERT_EQ(filter.rescale({2, 2}, {0, 0}), Status::ok);
        }
        if (k == 10 && way == 3) {
          ASSERT_EQ(filter.reset_variance(1, 1e-80), Status::ok);
        }
      }
      EXPECT_LE(std::abs(static_cast<double>(filter.x()(0) - x[0])), 64 * 2.3e-16 * 1.6) << way;
    }
  });
}

// The sum may be a double though a product on the way to it was not: 3 (2 - λ) x_1 rounds, 2 x_0 + 3 (2 - λ)
// x_1 does not; and a state may be known to 1e-30 and not exactly.
struct RoundsOnTheWay {
  static constexpr int states = 2, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {2.0 * x(0) + 3 * (2 - contracting) * x(1), contracting * x(1)};
  }
};
TEST(NamedCases, AMoveThatRoundsOnTheWayIsMadeInTwiceTheDigits) {
  for (const double variance : {0.0, 1e-80, 1e-60, 1e-36}) {
    jml::Filter filter{
        jml::Kalman{}, RoundsOnTheWay{},
        jml::Estimate<double, 2>{jml::Vector<double, 2>(-3, 1), variance * Matrix<double, 2, 2>::Identity()}};
    Quad power = 1;
    for (int k = 0; k < 24; ++k) {
      ASSERT_EQ(filter.predict(), Status::ok);
      power *= contracting;
    }
    const double bound = 1e-6 * std::sqrt(filter.P()(0, 0)) + 64 * 2.3e-16 * 3;
    EXPECT_LE(std::abs(static_cast<double>(filter.x()(0) + 3 * power)), bound) << variance;
  }
}

}  // namespace
