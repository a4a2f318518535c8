// SPDX-License-Identifier: BSD-3-Clause
// The one-step recursion of Table 1 against the printed formula with explicit inverses, slot by slot.
#include <gtest/gtest.h>

#include <jml/filter/pure.hpp>
#include <jml/riccati/difference.hpp>

#include "models/linear.hpp"
#include "models/polynomial.hpp"
#include "models/radar.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

using jml::Slot;
using oracle::big;
using oracle::Big;

// Agreement asked: 1e-13 relative, some 400 ε. The steps below have condition numbers below about 100.
constexpr double tolerance = 1e-13;

/// One step's ingredients, evaluated by the model's hand-written functions about the origin.
struct Ingredients {
  Big f_x, F, m_x, M, noise, R, f, innovation;

  oracle::Slots slots(Slot a, Slot b, Slot d, Slot e) const {
    const auto dynamics = [&](Slot s) { return s == Slot::sdc ? F : f_x; };
    const auto sensor = [&](Slot s) { return s == Slot::sdc ? M : m_x; };
    return {dynamics(a), dynamics(b), sensor(d), sensor(e), noise, R};
  }
};

template <typename D, typename S, int n, int p>
Ingredients ingredients(const D& d, const S& s, const jml::Vector<double, n>& x,
                        const jml::Vector<double, p>& y) {
  Ingredients out;
  out.f_x = big(d.dynamics_jacobian(x));
  out.F = big(d.dynamics_sdc(x));
  const jml::Vector<double, n> f = d.dynamics(x);
  out.f = big(f);
  out.m_x = big(s.measurement_jacobian(f));
  out.M = big(s.measurement_sdc(f));
  out.innovation = big(jml::Vector<double, p>(y - s.measurement(f)));
  const Big G = big(d.disturbance_input());
  out.noise = G * big(d.disturbance_covariance()) * G.transpose();
  out.R = big(s.noise_covariance());
  return out;
}

/// A model pair, an estimate and a measurement.
template <typename D, typename S>
struct Case {
  static constexpr int n = D::states, p = S::measurements;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> prior;
  jml::Vector<double, p> y;

  template <typename Rule>
  jml::StepResult<double, n, p> step(const Rule& rule) const {
    return jml::step(rule, dynamics, sensor, prior, y);
  }
  Ingredients oracle() const { return ingredients(dynamics, sensor, prior.x, y); }
};

template <int n, int p>
Case<models::Polynomial<n>, models::PolynomialSensor<n, p>> polynomial_case(bool symmetric, double constant) {
  jml::Noise noise(31);
  Case<models::Polynomial<n>, models::PolynomialSensor<n, p>> c;
  c.dynamics.constant = c.sensor.constant = constant;
  c.prior.x = models::random_matrix<n, 1>(noise);
  c.prior.P = models::random_covariance<n>(noise, 0.2);
  if (!symmetric) c.prior.P += 0.3 * models::random_matrix<n, n>(noise);
  c.y = c.sensor.measurement(c.dynamics.dynamics(c.prior.x)) + 0.3 * models::random_matrix<p, 1>(noise);
  return c;
}

Case<models::BallisticTarget, models::Radar> radar_case(bool symmetric) {
  jml::Noise noise(32);
  Case<models::BallisticTarget, models::Radar> c;
  c.prior.x << 3, 2, 4, -0.5, 0.4, 0.3;
  c.prior.P = models::random_covariance<6>(noise, 0.2) * 1e-3;
  c.dynamics.acceleration_variance = 0.1;
  if (!symmetric) c.prior.P += 3e-4 * models::random_matrix<6, 6>(noise);
  c.y = c.sensor.measurement(c.dynamics.dynamics(c.prior.x)) + 0.01 * models::random_matrix<3, 1>(noise);
  return c;
}

template <int n, int p>
void expect_equal(const jml::StepResult<double, n, p>& got, const oracle::Posterior& wanted,
                  const Ingredients& model, const char* rule) {
  SCOPED_TRACE(rule);
  ASSERT_EQ(got.report.status, jml::Status::ok);
  EXPECT_LT(oracle::distance(got.estimate.P, wanted.P), tolerance);
  EXPECT_LT(oracle::distance(got.report.gain, wanted.gain), tolerance);
  EXPECT_LT(oracle::distance(got.estimate.x, wanted.x), tolerance);
  EXPECT_LT(oracle::distance(got.report.innovation, model.innovation), tolerance);
}

template <Slot a, Slot b, Slot d, Slot e, typename C>
void check_slots(const C& c, const char* name) {
  const Ingredients model = c.oracle();
  const oracle::Slots slots = model.slots(a, b, d, e);
  const auto got = c.step(jml::GainRule<a, b, d, e>{});
  const auto wanted = oracle::brute_force(slots, model.f, big(c.prior.P), model.innovation);
  expect_equal(got, wanted, model, name);
  const Big N = oracle::predicted(slots, big(c.prior.P));
  EXPECT_LT(oracle::distance(got.report.innovation_matrix, slots.R + slots.E * N * slots.D.transpose()),
            tolerance)
      << name;
}

constexpr Slot J = Slot::jacobian, C = Slot::sdc;

template <typename Case>
void check_named_rules(const Case& symmetric, const Case& nonsymmetric) {
  {
    const Ingredients m = symmetric.oracle();
    const Big P = big(symmetric.prior.P);
    expect_equal(symmetric.step(jml::Ekf{}), oracle::joseph(m.slots(J, J, J, J), m.f, P, m.innovation), m,
                 "EKF");
    expect_equal(symmetric.step(jml::Sddre{}), oracle::joseph(m.slots(C, C, C, C), m.f, P, m.innovation), m,
                 "SDDRE");
  }
  const Ingredients m = nonsymmetric.oracle();
  const Big P = big(nonsymmetric.prior.P);
  const oracle::Slots jml_slots{m.F, m.f_x, m.m_x, m.M, m.noise, m.R};
  expect_equal(nonsymmetric.step(jml::Jml{}), oracle::brute_force(jml_slots, m.f, P, m.innovation), m, "JML");
  // The oracles are two: agreement of the forms with each other is part of the evidence.
  const auto one = oracle::brute_force(jml_slots, m.f, P, m.innovation);
  const auto two = oracle::push_through(jml_slots, m.f, P, m.innovation);
  EXPECT_LT(oracle::distance(one.P, two.P), 1e-15);
}

template <typename Case>
void check_every_nonsymmetric_rule(const Case& c) {
  check_slots<C, J, J, C>(c, "F f_x m_x M");
  check_slots<J, C, J, C>(c, "f_x F m_x M");
  check_slots<C, J, C, J>(c, "F f_x M m_x");
  check_slots<J, C, C, J>(c, "f_x F M m_x");
  check_slots<C, J, J, J>(c, "F f_x m_x m_x");
  check_slots<J, C, C, C>(c, "f_x F M M");
}

TEST(TableOne, NamedRulesOfFourStatesTwoMeasurements) {
  check_named_rules(polynomial_case<4, 2>(true, 0), polynomial_case<4, 2>(false, 0));
}
TEST(TableOne, NamedRulesWhereTheOriginIsNoEquilibrium) {
  check_named_rules(polynomial_case<4, 2>(true, 1), polynomial_case<4, 2>(false, 1));
}
TEST(TableOne, NamedRulesOfThreeStatesOneMeasurement) {
  check_named_rules(polynomial_case<3, 1>(true, 0.5), polynomial_case<3, 1>(false, 0.5));
}
TEST(TableOne, NamedRulesOfSixStatesThreeMeasurements) {
  check_named_rules(radar_case(true), radar_case(false));
}

TEST(TableOne, EverySlotOfFourStatesTwoMeasurements) {
  check_every_nonsymmetric_rule(polynomial_case<4, 2>(false, 0));
}

// A rule of the user's own that is symmetric in the prediction alone: its P is nonsymmetric, so N is too.
TEST(TableOne, RulesThatAreSymmetricOnOneSideOnly) {
  const auto c = polynomial_case<4, 2>(false, 0);
  check_slots<J, J, J, C>(c, "f_x f_x m_x M");
  check_slots<C, C, C, J>(c, "F F M m_x");
}

// The test is worth something only if the four slots differ by far more than the tolerance.
TEST(TableOne, ExchangingTwoSlotsWouldShow) {
  const auto c = polynomial_case<4, 2>(false, 0);
  const Ingredients m = c.oracle();
  const Big P = big(c.prior.P);
  const auto posterior = [&](Slot a, Slot b, Slot d, Slot e) {
    return oracle::brute_force(m.slots(a, b, d, e), m.f, P, m.innovation).P;
  };
  const Big right = posterior(C, J, J, C);
  const Slot wrong[][4] = {{J, C, J, C}, {C, J, C, J}, {J, C, C, J}, {C, C, J, J},
                           {J, J, C, C}, {J, J, J, J}, {C, C, C, C}};
  for (const auto& w : wrong) EXPECT_GT(oracle::distance(posterior(w[0], w[1], w[2], w[3]), right), 1e-3);
  const oracle::Slots slots = m.slots(C, J, J, C);
  EXPECT_GT(oracle::distance(oracle::brute_force(slots, m.f, P.transpose(), m.innovation).P, right), 1e-3);
}

TEST(TableOne, SymmetricRulesStayExactlySymmetric) {
  const auto c = polynomial_case<4, 2>(true, 1);
  for (const auto& P : {c.step(jml::Ekf{}).estimate.P, c.step(jml::Sddre{}).estimate.P}) {
    EXPECT_TRUE((P.array() == P.transpose().array()).all());
  }
  EXPECT_GT((c.step(jml::Jml{}).estimate.P - c.step(jml::Jml{}).estimate.P.transpose()).norm(), 1e-3);
}

// Singular priors: P = 0, P of rank one; and G Q Gᵀ of rank two among four states. No inverse of N exists.
TEST(TableOne, SingularPriorAndRankDeficientNoise) {
  auto c = polynomial_case<4, 2>(true, 1);
  const jml::Vector<double, 4> u(1, -2, 0.5, 1);
  const jml::Matrix<double, 4, 4> rank_one = u * u.transpose();
  for (const auto& P : {jml::Matrix<double, 4, 4>(jml::Matrix<double, 4, 4>::Zero()), rank_one}) {
    c.prior.P = P;
    const Ingredients m = c.oracle();
    ASSERT_LE(oracle::predicted(m.slots(J, J, J, J), big(P)).fullPivLu().rank(), 3);
    const auto check = [&](const auto& rule, Slot a, Slot b, Slot d, Slot e, const char* name) {
      expect_equal(c.step(rule), oracle::push_through(m.slots(a, b, d, e), m.f, big(P), m.innovation), m,
                   name);
    };
    check(jml::Ekf{}, J, J, J, J, "EKF");
    check(jml::Sddre{}, C, C, C, C, "SDDRE");
    check(jml::Jml{}, C, J, J, C, "JML");
  }
}

TEST(TableOne, NothingKnownIsLeftToLearn) {  // P = 0 and Q = 0: the estimate is the prediction, and P stays 0
  struct Exact : models::Polynomial<4> {
    jml::Matrix<double, 2, 2> disturbance_covariance() const { return jml::Matrix<double, 2, 2>::Zero(); }
  };
  const auto c = polynomial_case<4, 2>(true, 1);
  const jml::Vector<double, 4> f = Exact{}.dynamics(c.prior.x);
  const auto check = [&](const auto& rule) {
    const auto got = jml::step(rule, Exact{}, c.sensor, jml::Estimate<double, 4>{c.prior.x}, c.y);
    EXPECT_EQ(got.report.status, jml::Status::ok);
    EXPECT_EQ(got.estimate.P.norm(), 0);
    EXPECT_EQ(got.estimate.x, f);
  };
  check(jml::Ekf{});
  check(jml::Sddre{});
  check(jml::Jml{});
}

}  // namespace
