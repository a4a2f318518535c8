// SPDX-License-Identifier: BSD-3-Clause
// What CVODE's tolerances are measured by: with the defaults (x, P) of a filter is right to 1e-4 in each component
// and in any units, and refused where it cannot be. Linear systems against their closed form in long double.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/continuous/cvode.hpp>

#include "continuous/continuous_frozen.hpp"

namespace {

using namespace jml::operators;

using jml::Cvode;
using jml::CvodeMethod;
using jml::Status;
using Real = long double;
template <int n>
using Square = jml::Matrix<double, n, n>;
template <int n>
using RealSquare = jml::Matrix<Real, n, n>;
using Two = Square<2>;

class CvodeTolerance : public testing::TestWithParam<CvodeMethod> {
 protected:
  static Cvode by_default() {
    Cvode cvode;
    cvode.method = GetParam();
    return cvode;
  }
};
INSTANTIATE_TEST_SUITE_P(Methods, CvodeTolerance, testing::Values(CvodeMethod::adams, CvodeMethod::bdf));

Two two(double a, double b, double c, double d) {
  Two out;
  out << a, b, c, d;
  return out;
}

/// ẋ = A x + w.
template <int n>
struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = n;
  Square<n> A, Q;
  long* calls = nullptr;  // of dynamics(), counted where it is given
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    if (calls != nullptr) ++*calls;
    jml::Vector<T, n> f;
    for (int i = 0; i < n; ++i) {
      f(i) = T(0.0);
      for (int j = 0; j < n; ++j) f(i) += A(i, j) * x(j);
    }
    return f;
  }
  Square<n> dynamics_jacobian(const jml::Vector<double, n>&) const { return A; }
  Square<n> disturbance_spectral_density() const { return Q; }
};

template <typename Dynamics, int n>
auto filter_of(const Dynamics& dynamics, const jml::Estimate<double, n>& start, const Cvode& cvode, double time = 0) {
  return jml::Filter{jml::Continuous{jml::Ekf{}, cvode}, dynamics, start, time};
}

/// The largest error of x_i over the larger of |x_i| and √P_ii, and of P_ij over √(P_ii P_jj). What is below 1e-270
/// is not looked at.
template <int n>
Real error(const jml::Estimate<double, n>& got, const jml::Vector<Real, n>& x, const RealSquare<n>& P) {
  Real worst = 0;
  const auto note = [&](Real off, Real scale) { worst = off <= scale * worst ? worst : off / scale; };
  for (int i = 0; i < n; ++i) {
    const Real deviation = std::sqrt(std::abs(P(i, i))), size = std::max(std::abs(x(i)), deviation);
    if (size > 1e-270L) note(std::abs(got.x(i) - x(i)), size);
    for (int j = 0; j < n; ++j) {
      const Real scale = deviation * std::sqrt(std::abs(P(j, j)));
      if (deviation > 1e-135L && P(j, j) > 1e-270L) note(std::abs(got.P(i, j) - P(i, j)), scale);
    }
  }
  return worst;
}

// ---- small variances: an oscillator of 0.3 rad/s over 1000 s, which is a rotation

const Plant<2> slow{two(0, 1, -0.09, 0), two(0, 0, 0, 1e-14)};
const jml::Estimate<double, 2> slow_start{{1e-3, 0}, two(1e-10, 0, 0, 1e-14)};

Real slow_error(const jml::Estimate<double, 2>& got, Real t) {
  const Real w = std::sqrt(Real(0.09)), q = 1e-14, c = std::cos(w * t), s = std::sin(w * t);
  RealSquare<2> turn, noise;
  turn << c, s / w, -w * s, c;
  noise << q / (w * w) * (t / 2 - s * c / (2 * w)), q * s * s / (2 * w * w), q * s * s / (2 * w * w),
      q * (t / 2 + s * c / (2 * w));
  const jml::Vector<Real, 2> x = turn * jml::kernel::cast<Real>(slow_start.x);
  const RealSquare<2> P = turn * jml::kernel::cast<Real>(slow_start.P) * jml::kernel::transposed(turn) + noise;
  return error(got, x, P);
}

// Measured: Adams 9e-7, BDF 1e-7. With a tolerance of 1e-8 for every component P_00 was off by 26 and 101 %.
TEST_P(CvodeTolerance, S11SmallVariances) {
  auto filter = filter_of(slow, slow_start, by_default());
  ASSERT_EQ(filter.predict(1000.0), Status::ok);
  EXPECT_LT(slow_error(filter.estimate(), 1000), 1e-5);
}
TEST_P(CvodeTolerance, SmallVariancesInManyIntervals) {
  auto filter = filter_of(slow, slow_start, by_default());
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(filter.predict(1.0), Status::ok);
  EXPECT_LT(slow_error(filter.estimate(), 1000), 1e-4);
}
// A clock that shows a billion seconds is no finer than 1e-7 s.
TEST_P(CvodeTolerance, TimeOfDay) {
  const jml::Estimate<double, 2> start{slow_start.x, Two::Zero()};
  auto early = filter_of(slow, start, by_default()), late = filter_of(slow, start, by_default(), 1e9);
  for (const double dt : {1e-9, 1e-6, 1e-3, 1.0}) {
    ASSERT_EQ(early.predict(dt), Status::ok) << dt;
    ASSERT_EQ(late.predict(dt), Status::ok) << dt;
    EXPECT_EQ(early.P(), late.P());
    EXPECT_EQ(early.x(), late.x());
  }
}

// ---- a family of linear systems in units of 2^±30

template <int n>
struct Case {
  Plant<n> plant;
  jml::Estimate<double, n> start;
  jml::Vector<double, n> unit;
  double dt;
};

template <int n>
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : noise_(seed) {}
  double between(double a, double b) { return a + (b - a) * noise_.uniform(); }
  double decades(double a, double b) { return std::pow(10.0, between(a, b)); }
  int below(int count) { return static_cast<int>(count * noise_.uniform()); }

  Square<n> covariance() {
    Square<n> root;
    for (int i = 0; i < n * n; ++i) root.data()[i] = noise_.normal();
    return jml::kernel::symmetric_part(Square<n>(root * jml::kernel::transposed(root)));
  }
  Square<n> diagonal(double from, double to) {
    Square<n> out = Square<n>::Zero();
    for (int i = 0; i < n; ++i) out(i, i) = decades(from, to);
    return out;
  }
  /// One entry on the diagonal.
  Square<n> single(double value) {
    Square<n> out = Square<n>::Zero();
    const int i = below(n);
    out(i, i) = value;
    return out;
  }

  /// 0: oscillators, damped or not; 1: decays, coupled one way; 2: unstable; 3: integrators; 4: stable, mostly.
  Square<n> system(int kind) {
    Square<n> A = Square<n>::Zero();
    const double damping = below(2) == 0 ? between(0, 0.2) : 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        const bool own = i == j, next = j == i + 1;
        if (kind == 0) A(i, j) = next ? 1 : i == j + 1 ? -between(0.1, 1) : own && i == n - 1 ? -damping : 0;
        if (kind == 1) A(i, j) = own ? -between(0.01, 1) : j > i ? between(-1, 1) : 0;
        if (kind == 2) A(i, j) = between(-1, 1) + (own ? 0.3 : 0);
        if (kind == 3) A(i, j) = next ? 1 : 0;
        if (kind == 4) A(i, j) = between(-1, 1) - (own ? 1 : 0);
      }
    }
    return A;
  }

  Case<n> problem() {
    Case<n> out;
    const int kind = below(5), prior = below(5), disturbance = below(4), mean = below(3);
    const double rate = decades(-6, 6), size = decades(-6, 6);
    out.plant.A = rate * system(kind);
    out.plant.Q = disturbance == 0   ? Square<n>(rate * decades(-9, 9) * covariance())
                  : disturbance == 1 ? Square<n>(rate * diagonal(-9, 9))
                  : disturbance == 2 ? single(rate * decades(-9, 9))
                                     : Square<n>(Square<n>::Zero());
    out.start.P = prior == 0   ? covariance()
                  : prior == 1 ? Square<n>(1e18 * covariance())
                  : prior == 2 ? diagonal(-9, 9)
                  : prior == 3 ? single(1)
                               : Square<n>(Square<n>::Zero());
    for (int i = 0; i < n; ++i) {
      out.start.x(i) = mean == 0 || (mean == 1 && i > 0) ? 0 : size * between(-1, 1);
      out.unit(i) = std::ldexp(1.0, below(61) - 30);
    }
    out.dt = decades(-3, kind == 2 ? 1.0 : kind == 4 ? 2.0 : 3.0) / rate;
    return out;
  }

 private:
  jml::Noise noise_;
};

/// The same in its units: nothing is rounded.
template <int n>
Case<n> in_units(Case<n> c) {
  for (int i = 0; i < n; ++i) {
    c.start.x(i) *= c.unit(i);
    for (int j = 0; j < n; ++j) {
      c.plant.A(i, j) *= c.unit(i) / c.unit(j);
      c.plant.Q(i, j) *= c.unit(i) * c.unit(j);
      c.start.P(i, j) *= c.unit(i) * c.unit(j);
    }
  }
  return c;
}
template <int n>
jml::Estimate<double, n> out_of_units(jml::Estimate<double, n> e, const jml::Vector<double, n>& unit) {
  for (int i = 0; i < n; ++i) {
    e.x(i) /= unit(i);
    for (int j = 0; j < n; ++j) e.P(i, j) /= unit(i) * unit(j);
  }
  return e;
}

/// x and P after dt: e^{Ah} and its integral by their series, doubled until h is dt.
template <int n>
void solve(const Case<n>& c, jml::Vector<Real, n>& x, RealSquare<n>& P) {
  const RealSquare<n> A = jml::kernel::cast<Real>(c.plant.A);
  int doublings = 0;
  Real h = c.dt;
  for (; h * jml::kernel::norm(A) > 0.1L; h /= 2) ++doublings;
  RealSquare<n> F = RealSquare<n>::Identity(), power = F, term = h * jml::kernel::cast<Real>(c.plant.Q), S = term;
  for (int k = 1; k < 30; ++k) {
    power = (h / k) * (A * power);
    F = F + power;
    term = (h / (k + 1)) * (A * term + term * jml::kernel::transposed(A));
    S = S + term;
  }
  for (; doublings > 0; --doublings) {
    S = F * S * jml::kernel::transposed(F) + S;
    F = F * F;
  }
  x = F * jml::kernel::cast<Real>(c.start.x);
  P = F * jml::kernel::cast<Real>(c.start.P) * jml::kernel::transposed(F) + S;
}

template <int n>
void expect_right(const Cvode& cvode, unsigned seeds) {
  unsigned refused = 0;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "n = " << n << ", seed " << seed);
    const Case<n> plain = Draw<n>(seed).problem(), scaled = in_units(plain);
    auto filter = filter_of(scaled.plant, scaled.start, cvode);
    const Status status = filter.predict(scaled.dt);
    if (status != Status::ok) {
      EXPECT_TRUE(status == Status::accuracy_not_met || status == Status::step_limit) << jml::describe(status);
      ++refused;
      continue;
    }
    jml::Vector<Real, n> x;
    RealSquare<n> P;
    solve(plain, x, P);
    EXPECT_LT(error(out_of_units(filter.estimate(), plain.unit), x, P), 1e-4);
  }
  EXPECT_LE(refused, seeds / 50);
}
// With one tolerance for every component a seventh of them was wrong, and ok.
TEST_P(CvodeTolerance, FamilyOfTwo) { expect_right<2>(by_default(), 200); }
TEST_P(CvodeTolerance, FamilyOfThree) { expect_right<3>(by_default(), 150); }

// Powers of two for units leave every step and every bit as they are.
TEST_P(CvodeTolerance, UnitsDoNotMatter) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Case<3> plain = Draw<3>(seed).problem();
    plain.start.P = Draw<3>(seed).covariance();
    plain.dt = std::min(plain.dt, 10 / jml::kernel::norm(plain.plant.A));
    const Case<3> scaled = in_units(plain);
    auto one = filter_of(plain.plant, plain.start, by_default());
    auto other = filter_of(scaled.plant, scaled.start, by_default());
    ASSERT_EQ(one.predict(plain.dt), other.predict(plain.dt));
    EXPECT_EQ(one.P(), out_of_units(other.estimate(), plain.unit).P) << seed;
    EXPECT_EQ(one.x(), out_of_units(other.estimate(), plain.unit).x) << seed;
  }
}

// ---- measured all the time, P symmetric or not, P0 and units at random, against the series of continuous_frozen

template <bool symmetric>
void expect_right_when_measured(const Cvode& cvode) {
  constexpr int n = 2, p = 1;
  int right = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    jml::Noise noise(seed);
    Draw<n> draw(seed);
    auto problem = continuous_frozen::random_problem<n, p>(noise, symmetric ? 0.0 : 0.3);
    problem.start.P *= seed % 5 == 0 ? 0.0 : draw.decades(-4, 4);
    problem.dynamics.Q *= draw.decades(-4, 2);
    const double dt = draw.decades(-3, 0);
    const auto wanted = continuous_frozen::solve(problem, dt);
    if (wanted.escaped || wanted.largest > 100 * (1 + jml::kernel::norm(problem.start.P))) continue;
    auto scaled = problem;
    jml::Vector<double, n> unit;
    for (int i = 0; i < n; ++i) unit(i) = std::ldexp(1.0, draw.below(61) - 30);
    const double unit_y = std::ldexp(1.0, draw.below(61) - 30);
    for (int i = 0; i < n; ++i) {
      scaled.start.x(i) *= unit(i);
      scaled.dynamics.a(i) *= unit(i);
      scaled.sensor.D(0, i) *= unit_y / unit(i);
      scaled.sensor.E(0, i) *= unit_y / unit(i);
      for (int j = 0; j < n; ++j) {
        scaled.dynamics.A(i, j) *= unit(i) / unit(j);
        scaled.dynamics.B(i, j) *= unit(i) / unit(j);
        scaled.dynamics.Q(i, j) *= unit(i) * unit(j);
        scaled.start.P(i, j) *= unit(i) * unit(j);
      }
    }
    scaled.sensor.R *= unit_y * unit_y;
    scaled.sensor.e *= unit_y;
    scaled.y *= unit_y;
    using Rule = std::conditional_t<symmetric, jml::Ekf<>, jml::Rnls<>>;
    jml::Filter filter{jml::Continuous{Rule{}, cvode}, scaled.dynamics, scaled.start};
    const Status status = filter.step(scaled.sensor, scaled.y, dt).status;
    EXPECT_EQ(status, Status::ok) << jml::describe(status);
    EXPECT_LT(error(out_of_units(filter.estimate(), unit), wanted.x, wanted.P), 1e-4);
    ++right;
  }
  EXPECT_GT(right, 50);
}
TEST_P(CvodeTolerance, Measured) { expect_right_when_measured<true>(by_default()); }
TEST_P(CvodeTolerance, MeasuredAndNotSymmetric) { expect_right_when_measured<false>(by_default()); }

// ---- zeros

/// ẋ = (x1², x2², 1): what is zero now is found only by a look ahead.
struct Squares {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 3, disturbances = 1;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x) const {
    return {x(1) * x(1), x(2) * x(2), T(1.0)};
  }
  jml::Matrix<double, 3, 1> disturbance_input() const { return {0, 0, 1}; }
  Square<1> disturbance_spectral_density() const { return Square<1>(0.0); }
};
TEST_P(CvodeTolerance, StartsFromNothing) {
  for (const double t : {1e-3, 1.0, 100.0}) {
    auto filter = filter_of(Squares{}, jml::Estimate<double, 3>{{0, 0, 0}, Square<3>::Zero()}, by_default());
    ASSERT_EQ(filter.predict(t), Status::ok) << t;
    EXPECT_NEAR(filter.x()(2) / t, 1, 1e-6);
    EXPECT_NEAR(filter.x()(1) / (t * t * t / 3), 1, 1e-6);
    EXPECT_NEAR(filter.x()(0) / (std::pow(t, 7) / 63), 1, 1e-6);
    EXPECT_EQ(filter.P(), Square<3>::Zero());
  }
}

/// At rest and known until 5 s, then driven and disturbed.
struct Late {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(1), T(at.time > 5 ? 1.0 : 0.0)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  Square<1> disturbance_spectral_density(const jml::Vector<double, 2>&, const auto& at) const {
    return Square<1>(at.time > 5 ? 1.0 : 0.0);
  }
};
TEST_P(CvodeTolerance, DrivenLate) {
  for (const int intervals : {1, 10, 100}) {
    auto filter = filter_of(Late{}, jml::Estimate<double, 2>{{0, 0}, Two::Zero()}, by_default());
    for (int k = 0; k < intervals; ++k) ASSERT_EQ(filter.predict(10.0 / intervals), Status::ok) << k;
    EXPECT_NEAR(filter.x()(0), 12.5, 1e-4 * 12.5);
    EXPECT_NEAR(filter.P()(0, 0), 125.0 / 3, 1e-4 * 125 / 3);
  }
}

/// A variance that dies out, fast and without noise, beside one that stays.
TEST_P(CvodeTolerance, DiesOut) {
  const Plant<2> plant{two(-1, 1, 0, -100), two(1, 0, 0, 0)};
  auto filter = filter_of(plant, jml::Estimate<double, 2>{{1, 1}, two(1, 0, 0, 1)}, by_default());
  ASSERT_EQ(filter.predict(20.0), Status::ok);
  EXPECT_NEAR(filter.P()(0, 0), 0.5, 1e-6);
  EXPECT_EQ(filter.P()(1, 1), 0);
  EXPECT_EQ(filter.P()(0, 1), 0);
  EXPECT_EQ(filter.P()(1, 0), 0);
}

// ---- what doubles cannot do is refused, and leaves the filter as it was

TEST_P(CvodeTolerance, RefusesWhatCancels) {
  const Plant<2> rotation{two(0, 1, -1, 0), Two::Zero()};
  const Plant<2> saddle{two(-0.28, -0.96, -0.96, 0.28), Two::Zero()};  // grows along (3, -4), decays along (4, 3)
  const auto refused = [](const Plant<2>& plant, const jml::Estimate<double, 2>& start, double dt) {
    auto filter = filter_of(plant, start, by_default());
    const Status status = filter.predict(dt);
    EXPECT_EQ(status, Status::accuracy_not_met) << jml::describe(status);
    EXPECT_EQ(filter.x(), start.x);
    EXPECT_EQ(filter.P(), start.P);
  };
  refused(rotation, {{0, 0}, two(1, 0, 0, 1e-14)}, std::acos(-1.0) / 2);  // P_00 falls from 1 to 1e-14
  refused(saddle, {{0.8, 0.6}, Two::Zero()}, 25);                         // x decays among errors that grow
  refused(saddle, {{0, 0}, two(0.64, 0.48, 0.48, 0.36)}, 25);             // and so does P
}

// ---- tolerances that are given

TEST_P(CvodeTolerance, GivenForAll) {
  const jml::Estimate<double, 2> start{{0, 0}, slow_start.P};
  long calls[2] = {};
  for (const double tolerance : {0.0, 1e-16}) {
    Plant<2> plant = slow;
    plant.calls = &calls[tolerance > 0];
    Cvode cvode = by_default();
    cvode.absolute_tolerance = tolerance;
    auto filter = filter_of(plant, start, cvode), exact = filter_of(slow, start, by_default());
    ASSERT_EQ(filter.predict(100.0), Status::ok);
    ASSERT_EQ(exact.predict(100.0), Status::ok);
    EXPECT_LT(jml::kernel::largest(Two(filter.P() - exact.P())), 1e-14 + 1e4 * tolerance);
  }
  EXPECT_LT(calls[1], 0.7 * static_cast<double>(calls[0]));
}
TEST_P(CvodeTolerance, GivenForEachState) {
  long calls[2] = {};
  for (const bool given : {false, true}) {
    Plant<2> plant{two(-1, 0, 0, -30), two(1, 0, 0, 1e-6), &calls[given]};
    Cvode cvode = by_default();
    if (given) cvode.absolute_tolerances = {0, 1};  // the second state does not count
    auto filter = filter_of(plant, jml::Estimate<double, 2>{{1, 1}, two(1, 0, 0, 1)}, cvode);
    ASSERT_EQ(filter.predict(1.0), Status::ok);
    EXPECT_NEAR(filter.P()(0, 0), 0.5 + 0.5 * std::exp(-2.0), 1e-6);
    EXPECT_NEAR(filter.x()(0), std::exp(-1.0), 1e-6);
  }
  EXPECT_LT(calls[1], 0.7 * static_cast<double>(calls[0]));
}
TEST_P(CvodeTolerance, GivenWrongly) {
  for (const std::vector<double>& bad : {std::vector<double>{1e-9}, {1e-9, 1e-9, 1e-9}, {1e-9, -1e-9}, {1e-9, NAN}}) {
    Cvode cvode = by_default();
    cvode.absolute_tolerances = bad;
    auto filter = filter_of(slow, slow_start, cvode);
    EXPECT_EQ(filter.predict(1.0), Status::invalid_option);
  }
}

// ---- the solver by itself

/// ż = -z of four components, z3 = 0.
struct Decay {
  Status derivative(double, const double* z, double* out) const {
    for (int k = 0; k < 4; ++k) out[k] = -z[k];
    return Status::ok;
  }
};
struct DecayWithTolerances : Decay {
  long* asked;
  void tolerances(double, double step, const double* z, double* out) const {
    ++*asked;
    EXPECT_TRUE(*asked == 1 ? step == 0 : *asked == 2 || step > 0) << *asked;
    for (int k = 0; k < 4; ++k) out[k] = 1e-9 * std::abs(z[k]) + 1e-300;
  }
};
TEST_P(CvodeTolerance, OfTheEquations) {
  long asked = 0;
  jml::CvodeSolver<4> solver(by_default());
  jml::Vector<double, 4> z(1, 1e-12, 1e12, 0);
  DecayWithTolerances equations;
  equations.asked = &asked;
  const auto report = solver.integrate(equations, 0, 30, z);
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_GT(asked, 50);
  EXPECT_NEAR(z(0) / std::exp(-30.0), 1, 1e-5);
  EXPECT_NEAR(z(1) / (1e-12 * std::exp(-30.0)), 1, 1e-5);
  EXPECT_NEAR(z(2) / (1e12 * std::exp(-30.0)), 1, 1e-5);
  EXPECT_EQ(z(3), 0);
}
TEST_P(CvodeTolerance, OfTheOptions) {
  const jml::Vector<double, 4> start(1, 1e-12, 1e12, 0);
  const auto integrate = [&](const Cvode& options) {
    jml::Vector<double, 4> z = start;
    return jml::CvodeSolver<4>(options).integrate(Decay{}, 0, 1, z);
  };
  Cvode options = by_default();
  EXPECT_EQ(integrate(options).status, Status::invalid_option);  // a zero, and nothing to compare it with
  options.absolute_tolerance = 1e-12;
  const auto all = integrate(options);
  EXPECT_EQ(all.status, Status::ok);
  options.absolute_tolerance = 0;
  options.absolute_tolerances = {1, 1e-6, 1e12, 1};
  const auto each = integrate(options);
  EXPECT_EQ(each.status, Status::ok);
  EXPECT_LT(2 * each.evaluations, all.evaluations);
  options.absolute_tolerances = {1, 1};
  EXPECT_EQ(integrate(options).status, Status::invalid_option);
}

}  // namespace
