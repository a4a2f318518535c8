// SPDX-License-Identifier: BSD-3-Clause
// A usable status of an exact step stands over a minimum of the criterion (11): of a root that is a saddle or
// a maximum the step goes on downhill, on both sides, to the lower minimum.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/iterated/factored_iterated.hpp>
#include <jml/iterated/iterated.hpp>

namespace {

using jml::Status;
template <int n>
using Vec = jml::Vector<double, n>;
template <int rows, int cols>
using Mat = jml::Matrix<double, rows, cols>;

template <int n>
struct Rest {
  static constexpr int states = n, disturbances = n;
  static constexpr bool linear = true;
  double q = 0;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return x;
  }
  Mat<n, n> disturbance_input() const { return Mat<n, n>::Identity(); }
  Mat<n, n> disturbance_covariance() const { return q * Mat<n, n>::Identity(); }
};

struct Square {
  static constexpr int measurements = 1;
  double r = 0.01;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(r); }
};

/// Ranges to two beacons at (±10, 0).
struct Beacons {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    const T a = x(0) - T(10), b = x(0) + T(10), h = x(1) * x(1);
    return jml::Vector<T, 2>(sqrt(a * a + h), sqrt(b * b + h));
  }
  Mat<2, 2> noise_covariance() const { return 0.01 * Mat<2, 2>::Identity(); }
};

// At x = 0 the derivative of x² vanishes: the prior is a root, a maximum of J = 50 between two minima.
template <typename Rule>
void expect_square_root(const Rule& rule, double P) {
  jml::Filter filter{rule, Rest<1>{1e-6}, jml::Estimate<double, 1>{0.0, 4.0}};
  const auto report = filter.step(Square{}, 1.0);
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_NEAR(std::abs(filter.x()(0)), 0.999375, 1e-6);
  EXPECT_NEAR(report.cost, 0.1249, 1e-4);
  EXPECT_NEAR(filter.P()(0, 0), P, 0.01 * P);
}
TEST(Minima, S6StationaryPrior) {
  expect_square_root(jml::IteratedJml{},
                     0.005);  // R over M m_x = x · 2 x, the SDC matrix beside the Jacobian
  expect_square_root(jml::Iekf{}, 0.0025);
}

template <typename Rule>
void expect_above_or_below(const Rule& rule) {
  jml::Filter filter{rule, Rest<2>{}, jml::Estimate<double, 2>{Vec<2>(0, 1e-6), 100 * Mat<2, 2>::Identity()}};
  const auto report = filter.update(Beacons{}, Vec<2>(14.142, 14.142));
  ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
  EXPECT_NEAR(filter.x()(0), 0, 1e-6);
  EXPECT_NEAR(std::abs(filter.x()(1)), 9.9992, 1e-3);
  EXPECT_NEAR(report.cost, 0.50, 5e-3);
}
TEST(Minima, S7BetweenTheBeacons) {
  expect_above_or_below(jml::IteratedJml{});
  expect_above_or_below(jml::Iekf{});
}

// The same of a window and of a whole interval.
TEST(Minima, S6AndS7OfAnInterval) {
  const jml::Estimate<double, 1> origin{0.0, 4.0};
  const auto is_square = [](double x, double cost) {
    EXPECT_NEAR(std::abs(x), 0.999375, 1e-6);
    EXPECT_NEAR(cost, 0.1249, 1e-4);
  };
  jml::Filter lag{jml::FixedLag<3>{}, Rest<1>{1e-6}, jml::Sensors<Square>{}, origin};
  const auto lagged = lag.step(Square{}, 1.0);
  EXPECT_TRUE(jml::usable(lagged.status)) << jml::describe(lagged.status);
  is_square(lag.x()(0), lagged.cost);

  jml::Batch batch{Rest<1>{1e-6}, jml::Sensors<Square>{}, origin, {.steps = 1, .measurements = 1}};
  ASSERT_EQ(batch.step(Square{}, 1.0).status, Status::ok);
  const auto solved = batch.solve();
  EXPECT_TRUE(jml::usable(solved.status)) << jml::describe(solved.status);
  is_square(batch.x(1)(0), solved.cost);

#ifdef JML_BY_NIGHT
  const jml::Estimate<double, 2> between{Vec<2>(0, 1e-6), 100 * Mat<2, 2>::Identity()};
  jml::Batch beside{Rest<2>{}, jml::Sensors<Beacons>{}, between, {.steps = 1, .measurements = 1}};
  ASSERT_EQ(beside.update(Beacons{}, Vec<2>(14.142, 14.142)).status, Status::ok);
  const auto found = beside.solve();
  EXPECT_TRUE(jml::usable(found.status)) << jml::describe(found.status);
  EXPECT_NEAR(beside.x(0)(0), 0, 1e-6);
  EXPECT_NEAR(std::abs(beside.x(0)(1)), 9.9992, 1e-3);
  EXPECT_NEAR(found.cost, 0.50, 5e-3);
#endif
}

// And where only twice the digits hold P.
TEST(Minima, StationaryPriorFarAboveTheNoise) {
  for (const double r : {1e-14, 1e-18, 1e-24}) {
    const auto expect_one = [r](const auto& filter, const auto& report) {
      EXPECT_EQ(filter.status(), Status::ok);
      ASSERT_TRUE(jml::usable(report.status)) << r << jml::describe(report.status);
      EXPECT_NEAR(std::abs(filter.x()(0)), 1, 1e-6) << r;
    };
    const jml::Estimate<double, 1> origin{0.0, 4.0};
    jml::Filter plain{jml::Iekf{}, Rest<1>{1e-6}, origin};
    expect_one(plain, plain.step(Square{r}, 1.0));
    jml::Filter factored{jml::Factored{jml::Iekf{}}, Rest<1>{1e-6}, origin};
    expect_one(factored, factored.step(Square{r}, 1.0));
  }
}

// Without a solver to go down by, the root is named for what it is.
TEST(Minima, NamedWithoutFallback) {
  jml::Filter filter{jml::IteratedJml{jml::IterationOptions{.use_fallback = false}}, Rest<1>{1e-6},
                     jml::Estimate<double, 1>{0.0, 4.0}};
  EXPECT_EQ(filter.step(Square{}, 1.0).status, Status::no_minimum);
  EXPECT_EQ(filter.x()(0), 0);
  EXPECT_EQ(filter.P()(0, 0), 4);
}

/// f and m with vanishing second-order terms alone beside x, and a stationary point of J at x = 0 that is of
/// any kind.
template <int n>
struct Bent {
  static constexpr int states = n, disturbances = n;
  std::array<Mat<n, n>, n> bend;
  Mat<n, n> Q;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> out = x;
    for (int i = 0; i < n; ++i) out(i) += form(bend[i], x);
    return out;
  }
  template <typename T>
  static T form(const Mat<n, n>& A, const jml::Vector<T, n>& x) {
    T sum(0);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) sum += 0.5 * A(i, j) * x(i) * x(j);
    }
    return sum;
  }
  Mat<n, n> disturbance_input() const { return Mat<n, n>::Identity(); }
  Mat<n, n> disturbance_covariance() const { return Q; }
};
template <int n>
struct Bowl {
  static constexpr int measurements = 2;
  std::array<Mat<n, n>, 2> bend;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, n>& x) const {
    return jml::Vector<T, 2>(Bent<n>::form(bend[0], x), Bent<n>::form(bend[1], x));
  }
  Mat<2, 2> noise_covariance() const { return 0.1 * Mat<2, 2>::Identity(); }
};
template <int n>
Mat<n, n> symmetric(jml::Noise& noise, double size) {
  Mat<n, n> out;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) out(i, j) = out(j, i) = size * noise.normal();
  }
  return out;
}
/// Least eigenvalue of the Hessian of J over (x_0 in deviations, w in deviations), by differences of J
/// itself.
template <int n, typename J>
double least_curvature(const J& cost, const Eigen::Matrix<double, 2 * n, 1>& u) {
  Eigen::Matrix<double, 2 * n, 2 * n> H;
  constexpr double h = 1e-4;
  const auto at = [&](int i, double a, int j, double b) {
    auto v = u;
    v(i) += a;
    v(j) += b;
    return cost(v);
  };
  for (int i = 0; i < 2 * n; ++i) {
    for (int j = 0; j <= i; ++j)
      H(i, j) = H(j, i) =
          (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4 * h * h);
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 2 * n, 2 * n>>(H).eigenvalues()(0);
}
template <int n>
void expect_minima(std::uint64_t seed, int runs) {
  jml::Noise noise(seed);
  int planted = 0, usable = 0, intervals = 0;
  for (int k = 0; k < runs; ++k) {
    Bent<n> model;
    Bowl<n> bowl{{symmetric<n>(noise, 1), symmetric<n>(noise, 1)}};
    for (auto& bend : model.bend) bend = symmetric<n>(noise, 0.2);
    Mat<n, n> root_P, root_Q;
    for (int i = 0; i < n * n; ++i) {
      root_P.data()[i] = noise.normal() / std::sqrt(n);
      root_Q.data()[i] = (k % 3 == 0 ? 0 : 0.5) * noise.normal() / std::sqrt(n);  // none, or of any size
    }
    model.Q = root_Q * root_Q.transpose();
    const Mat<n, n> P = root_P * root_P.transpose();
    const Vec<2> y(noise.normal(), noise.normal());
    const auto cost = [&](const Eigen::Matrix<double, 2 * n, 1>& u) {
      const Vec<n> x0 = root_P * u.template head<n>(), w = root_Q * u.template tail<n>();
      const Vec<n> x1 = model.dynamics(x0) + w;
      const Vec<2> miss = y - bowl.measurement(x1);
      return 0.5 * u.squaredNorm() + 0.5 * miss.squaredNorm() / 0.1;
    };
    using U = Eigen::Matrix<double, 2 * n, 1>;
    const bool saddle = least_curvature<n>(cost, U(U::Zero())) < -1e-3;
    planted += saddle;
    if constexpr (n == 2) {  // the same of an interval
      jml::Batch batch{model,
                       jml::Sensors<Bowl<n>>{},
                       jml::Estimate<double, n>{Vec<n>(Vec<n>::Zero()), P},
                       {.steps = 1, .measurements = 1}};
      EXPECT_EQ(batch.step(bowl, y).status, Status::ok);
      const auto solved = batch.solve();
      intervals += jml::usable(solved.status);
      if (jml::usable(solved.status)) {
        U v;
        v.template head<n>() = root_P.fullPivLu().solve(batch.x(0));
        const Vec<n> w = batch.x(1) - model.dynamics(Vec<n>(batch.x(0)));
        v.template tail<n>() = k % 3 == 0 ? Vec<n>(Vec<n>::Zero()) : Vec<n>(root_Q.fullPivLu().solve(w));
        EXPECT_NEAR(cost(v), solved.cost, 1e-6 * (1 + solved.cost)) << k;
        EXPECT_GT(least_curvature<n>(cost, v), -1e-4) << "interval, problem " << k;
      }
    }
    jml::Filter filter{jml::IteratedJml{}, model, jml::Estimate<double, n>{Vec<n>(Vec<n>::Zero()), P}};
    const auto report = filter.step(bowl, y);
    if (!jml::usable(report.status)) continue;
    ++usable;
    // u of the answer: x_s = root_P a; w = x_1 - f(x_s) = root_Q b, of the least length where Q is zero.
    U u;
    u.template head<n>() = root_P.fullPivLu().solve(report.smoothed);
    const Vec<n> w = filter.x() - model.dynamics(report.smoothed);
    u.template tail<n>() = k % 3 == 0 ? Vec<n>(Vec<n>::Zero()) : Vec<n>(root_Q.fullPivLu().solve(w));
    ASSERT_NEAR(cost(u), report.cost, 1e-6 * (1 + report.cost)) << k;
    EXPECT_GT(least_curvature<n>(cost, u), -1e-4) << "n = " << n << ", problem " << k;
    EXPECT_LE(report.cost, cost(U::Zero()) * (1 + 1e-12)) << k;
  }
  std::printf("n = %d: %d of %d priors are saddles or maxima; %d answered\n", n, planted, runs, usable);
  EXPECT_GT(planted, runs / 4);
  EXPECT_GE(usable, runs - runs / 100);
  EXPECT_GE(intervals, n == 2 ? runs - runs / 100 : 0);
}
TEST(Minima, NeverAPlantedSaddle) {
  expect_minima<2>(5, 600);
#ifdef JML_BY_NIGHT
  expect_minima<6>(6, 300);
#endif
}

/// x⁺ = c x² beside y = x⁺: f alone bends.
struct Parabola {
  static constexpr int states = 1, disturbances = 1;
  double c = 1, q = 0.02;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(c * x(0) * x(0));
  }
  Mat<1, 1> disturbance_input() const { return Mat<1, 1>(1); }
  Mat<1, 1> disturbance_covariance() const { return Mat<1, 1>(q); }
};
struct State {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 0.03;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(r); }
};
// With x_1 at its best, J = ½ x_s²/P + ½ (y - c x_s²)²/(Q + R), stationary at the prior x_s = 0 for every y,
// of curvature 1/P - 2 c y/(Q + R): a maximum between two minima x_s² = (y - (Q + R)/(2 c P))/c where that is
// positive, else the only minimum.
TEST(Minima, ThatFAloneBends) {
  constexpr double S = 0.05;  // Q + R
  for (const double c : {1.0, -0.5}) {
    for (const double P : {0.25, 4.0}) {
      for (const double y : {1.0, 0.3, 0.01, 0.002, -0.01, -0.3, -1.0}) {
        const Parabola model{c};
        const double square = std::max(0.0, (y - S / (2 * c * P)) / c), least = std::sqrt(square),
                     f = c * square, cost = square / (2 * P) + (y - f) * (y - f) / (2 * S),
                     next = f + 0.02 / S * (y - f);
        const jml::Estimate<double, 1> origin{0.0, P};
        const auto expect_least = [&](const char* who, Status status, double J, double smoothed, double x) {
          SCOPED_TRACE(who);
          EXPECT_TRUE(jml::usable(status) && (least > 0 || status == Status::ok)) << jml::describe(status);
          EXPECT_NEAR(J, cost, 1e-9 * (1 + cost));
          if (least == 0) {
            EXPECT_EQ(smoothed, 0);
          }
          EXPECT_NEAR(std::abs(smoothed), least, 1e-6);
          EXPECT_NEAR(x, next, 1e-6);
        };
        SCOPED_TRACE("c " + std::to_string(c) + ", P " + std::to_string(P) + ", y " + std::to_string(y));
        jml::Filter filter{jml::IteratedJml{}, model, origin};
        const auto step = filter.step(State{}, y);
        expect_least("IteratedJml", step.status, step.cost, step.smoothed(0), filter.x()(0));
#ifdef JML_BY_NIGHT
        jml::Filter lag{jml::FixedLag<3>{}, model, jml::Sensors<State>{}, origin};
        const auto lagged = lag.step(State{}, y);
        expect_least("FixedLag", lagged.status, lagged.cost, lag.x(1)(0), lag.x()(0));
        jml::Batch batch{model, jml::Sensors<State>{}, origin, {.steps = 1, .measurements = 1}};
        ASSERT_EQ(batch.step(State{}, y).status, Status::ok);
        const auto solved = batch.solve();
        expect_least("Batch", solved.status, solved.cost, batch.x(0)(0), batch.x(1)(0));
#endif
      }
    }
  }
}

/// The least J of ½ (x - x̂)²/P + ½ (y - x²)²/R, of all real roots of its derivative by bisection between the
/// turning points of that cubic.
double least_cost(double prior, double P, double R, double y) {
  const auto J = [&](double x) {
    return ((x - prior) * (x - prior) / P + (y - x * x) * (y - x * x) / R) / 2;
  };
  const auto slope = [&](double x) { return (x - prior) / P - 2 * x * (y - x * x) / R; };
  const double bend = (2 * y / R - 1 / P) * R / 6, turn = bend > 0 ? std::sqrt(bend) : 0;
  const double far = 10 + std::abs(prior) + std::abs(y) + turn;
  double least = std::numeric_limits<double>::infinity();
  const double edges[] = {-far, -turn, turn, far};
  for (int k = 0; k < 3; ++k) {
    double low = edges[k], high = edges[k + 1];
    if (!(slope(low) <= 0 && slope(high) >= 0)) continue;  // a minimum lies between
    for (int i = 0; i < 200; ++i) (slope((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
    least = std::min(least, J((low + high) / 2));
  }
  return least;
}
TEST(Minima, LeastCostOfASquare) {
  jml::Noise noise(41);
  int best = 0, usable = 0;
  constexpr int runs = 20'000;
  for (int k = 0; k < runs; ++k) {
    const double prior = 1.5 * noise.normal(), P = std::exp(1.5 * noise.normal()),
                 R = std::exp(2 * noise.normal() - 3);
    const double truth = prior + std::sqrt(P) * noise.normal(),
                 y = truth * truth + std::sqrt(R) * noise.normal();
    jml::Filter filter{jml::IteratedJml{}, Rest<1>{}, jml::Estimate<double, 1>{prior, P}};
    const auto report = filter.update(Square{R}, y);
    usable += jml::usable(report.status);
    const double least = least_cost(prior, P, R, y);
    const bool is_best = jml::usable(report.status) && report.cost <= least + 1e-7 * (1 + least);
    best += is_best;
    if (!is_best && k - best < 12)
      std::printf("x %g P %g R %g y %g: %s, x %g J %g, least %g, %d iterations by %d\n", prior, P, R, y,
                  jml::describe(report.status), filter.x()(0), report.cost, least, report.iterations,
                  int(report.solver));
  }
  std::printf("%d of %d usable, %d at the least cost\n", usable, runs, best);
  EXPECT_EQ(best, runs);
}

/// Ranges to three beacons, nearly in line: of the two points at which they agree but for a little, one is
/// right.
struct NearlyInLine {
  static constexpr int measurements = 3;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    const double at[3][2] = {{-10, 0}, {10, 0}, {2, 1}};
    jml::Vector<T, 3> out;
    for (int i = 0; i < 3; ++i) {
      const T a = x(0) - at[i][0], b = x(1) - at[i][1];
      out(i) = sqrt(a * a + b * b);
    }
    return out;
  }
  Mat<3, 3> noise_covariance() const { return 0.01 * Mat<3, 3>::Identity(); }
};
// A prior on the wrong side of the line: the whole interval from one start stays there.
TEST(Minima, SeveralStartsOfAnInterval) {
  const Vec<2> truth(1, -9), x0(0, 6);
  const auto y = NearlyInLine{}.measurement<double>(truth);
  jml::Batch batch{Rest<2>{},
                   jml::sensors<NearlyInLine>,
                   jml::Estimate<double, 2>{x0, 100 * Mat<2, 2>::Identity()},
                   {.steps = 2}};
  ASSERT_EQ(batch.step(NearlyInLine{}, y), Status::ok);
  ASSERT_EQ(batch.step(NearlyInLine{}, y), Status::ok);
  double least = std::numeric_limits<double>::infinity();
  Vec<2> there;
  for (int i = -300; i <= 300; ++i) {
    for (int j = -300; j <= 300; ++j) {
      const Vec<2> x(0.1 * i, 0.1 * j);
      const double cost =
          (x - x0).squaredNorm() / 200 + (y - NearlyInLine{}.measurement<double>(x)).squaredNorm() / 0.01;
      if (cost < least) least = cost, there = x;
    }
  }
  const auto alone = batch.solve();
  ASSERT_EQ(alone.status, Status::ok);
  EXPECT_GT(alone.cost, 10 * least);
  EXPECT_EQ(alone.agreed, 1);

  batch.start = jml::Start::several;
  const auto best = batch.solve();
  ASSERT_EQ(best.status, Status::ok);
  EXPECT_LE(best.cost, least);
  EXPECT_LT((batch.x(0) - there).norm(), 0.2);
  EXPECT_GE(best.agreed, 1);
  EXPECT_LE(best.agreed, 5);  // of six, the first of which stays on the other side
  EXPECT_GT(best.iterations, alone.iterations);
}

/// A folded m: its roots lie in several valleys of J.
struct Waves {
  static constexpr int measurements = 1;
  double frequency = 3, r = 0.01;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    using std::sin;
    return jml::Vector<T, 1>(x(0) + sin(frequency * x(0)));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(r); }
};
// No answer has a J above that of the prediction.
TEST(Minima, NeverAboveThePrediction) {
  jml::Noise noise(43);
  int answered = 0;
  constexpr int runs = 5000;
  for (int k = 0; k < runs; ++k) {
    const Waves waves{1 + 4 * std::abs(noise.normal()), std::exp(2 * noise.normal() - 2)};
    const double prior = noise.normal(), y = prior + 2 * noise.normal();
    const double P = std::exp(noise.normal()), miss = y - prior - std::sin(waves.frequency * prior);
    jml::Filter filter{jml::IteratedJml{}, Rest<1>{}, jml::Estimate<double, 1>{prior, P}};
    const auto report = filter.update(waves, y);
    if (!jml::usable(report.status)) continue;
    ++answered;
    EXPECT_LE(report.cost, miss * miss / (2 * waves.r) * (1 + 1e-9)) << k;
  }
  EXPECT_GT(answered, runs - runs / 100);
}

// As many starts as an int can count are a hundred, and find more than none.
TEST(Minima, AsManyStartsAsThereAre) {
  jml::Noise noise(44);
  int better = 0;
  for (int k = 0; k < 1000; ++k) {
    const Waves waves{2 + 4 * std::abs(noise.normal()), 0.01};
    const double prior = noise.normal(), y = prior + 2 * noise.normal();
    const auto cost_of = [&](int starts) {
      const jml::IterationOptions options{.starts = starts};
      jml::Filter filter{jml::IteratedJml{options}, Rest<1>{}, jml::Estimate<double, 1>{prior, 2.0}};
      const auto report = filter.update(waves, y);
      return jml::usable(report.status) ? report.cost : std::numeric_limits<double>::infinity();
    };
    const double most = cost_of(100);
    EXPECT_EQ(cost_of(std::numeric_limits<int>::max()), most) << k;
    better += most < cost_of(0) * (1 - 1e-6);
  }
  EXPECT_GT(better, 0);
}

/// y = x_0².
struct SquareOfFirst : Square {
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
};
// With a P that is not symmetric there is no (11), and no minimum to look for: the root of (9) is the answer.
TEST(Minima, OfASymmetricPAlone) {
  for (const double skew : {0.0, 0.5}) {
    Mat<2, 2> P;
    P << 4, skew, -skew, 4;
    jml::Filter filter{jml::IteratedJml{}, Rest<2>{}, jml::Estimate<double, 2>{Vec<2>(0, 1), P}};
    const auto report = filter.update(SquareOfFirst{}, 1.0);
    ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
    EXPECT_NEAR(std::abs(filter.x()(0)), skew == 0 ? 0.9994 : 0, 1e-3);
  }
}

}  // namespace
