// SPDX-License-Identifier: BSD-3-Clause
// The generator, at the suite's size, on the estimators of an interval: every node of a batch and of a
// smoother, and the window of a fixed lag, by night more of them. In double; the long run (covariance_generator.cpp) has
// float too.
#include <gtest/gtest.h>

#include <jml/filter/way_out.hpp>

#include "by_night.hpp"
#include "rounding/known_states.hpp"
#include "rounding/tally.hpp"

namespace {

using namespace rounding;

template <int n, int p>
void fly_each(const Problem& problem, Tally& tally) {
  const Flight flight(problem);
  tally.add(Form::fixed_lag, problem, fly_fixed_lag<double, n, p>(problem, flight), false);
  tally.add(Form::batch, problem, fly_batch<double, n, p>(problem, flight), false);
  tally.add(Form::smoother, problem, fly_smoother<double, n, p>(problem, flight), false);
}
void fly_all(std::uint64_t seed, std::uint64_t number, Tally& tally) {
  with_size(number, [&]<int n, int p>() {
    const Problem problem = make_problem(seed, number, n, p, false);
    if (problem.dense) fly_each<n, p>(problem, tally);
  });
}

TEST(IntervalGenerator, RightWhereTheyAnswer) {
  Tally tally;
  const std::uint64_t numbers = by_night() ? 2000 : 800;
  for (std::uint64_t number = 0; number < numbers; ++number) {
    if (!is_single(number)) fly_all(2, number, tally);
  }
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print(form, false);
    tally.print_figures(form, false);
    tally.print_wrong(form, false);
    const auto all = tally.total(form, false);
    EXPECT_GT(all.problems, numbers / 4) << name_of(form);
    EXPECT_EQ(all.wrong_P, 0) << name_of(form);
    EXPECT_EQ(all.wrong_x, 0) << name_of(form);
  }
}

// Problems of a long run that were wrong once: sweeps that each left a quarter of the error, a singular P_0 whose
// root in the digits of double is none, and a slope that cancels to less than its rounding allows.
TEST(IntervalGenerator, OnceWrong) {
  Tally tally;
  for (const std::uint64_t number : {288028, 9502, 101404, 50982}) fly_all(31, number, tally);
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print_wrong(form, false);
    EXPECT_EQ(tally.total(form, false).wrong(), 0) << name_of(form);
    EXPECT_LE(tally.total(form, false).refused, 2) << name_of(form);
  }
}

// And two that a smoother went through in the digits of double, where λ and I + BᵀΛB left too few: P of the second
// is none that a matrix of doubles holds.
TEST(IntervalGenerator, OnceWrongInASmoother) {
  Tally tally;
  for (const std::uint64_t number : {250378, 279832}) fly_all(59, number, tally);
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print_wrong(form, false);
    EXPECT_EQ(tally.total(form, false).wrong(), 0) << name_of(form);
    EXPECT_LE(tally.total(form, false).refused, form == Form::smoother ? 1 : 0) << name_of(form);
  }
}

// And two in which an ε of x is many deviations of what later measurements say: a state of -208 that is measured to
// 7e-10, and a residual that was kept as an attempt in the digits of double had found it.
TEST(IntervalGenerator, OnceWrongByTheDigitsOfX) {
  Tally tally;
  for (const std::uint64_t number : {99353, 39652}) fly_all(97, number, tally);
  tally.print_wrong(Form::smoother, false);
  EXPECT_EQ(tally.total(Form::smoother, false).wrong() + tally.total(Form::smoother, false).refused, 0);
  EXPECT_EQ(tally.total(Form::batch, false).wrong(), 0);
}

// And one of a singular P_0 on large states: whitened, the first state of a window was off by 5e-3 deviations, J of
// the nominal by as much, and the step that mended it looked as if it raised J. In the other the newest state is 11,
// what is left of 5e3 of a state before it: there is no deviation beside its rounding, and it is as right as that.
TEST(IntervalGenerator, OnceWrongInAWindow) {
  Tally tally;
  fly_all(83, 364068, tally);
  fly_all(97, 107799, tally);
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print_wrong(form, false);
    EXPECT_EQ(tally.total(form, false).wrong() + tally.total(form, false).refused, 0) << name_of(form);
  }
}

// And one of a state of 1e9 beside one that doubles each step and ends at 5e13: an ε of the first, in the second at
// the second node, was 1.6e-6 deviations at the end, when only what was sent back had twice the digits.
TEST(IntervalGenerator, OnceWrongWhereAnExpandingStateIsLedAlong) {
  Tally tally;
  fly_all(900, 106794, tally);
  tally.print_wrong(Form::batch, false);
  EXPECT_EQ(tally.total(Form::batch, false).wrong() + tally.total(Form::batch, false).refused, 0);
  EXPECT_EQ(tally.total(Form::fixed_lag, false).wrong() + tally.total(Form::smoother, false).wrong(), 0);
}

// Two windows that are off by 0.2 and 0.5 deviations where the count of rounding in J's curvature is not believed.
TEST(IntervalGenerator, RoundingThatIsCounted) {
  Tally tally;
  for (const std::uint64_t number : {39192, 8969}) fly_all(900, number, tally);
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print_wrong(form, false);
    EXPECT_EQ(tally.total(form, false).wrong(), 0) << name_of(form);
  }
  EXPECT_LE(tally.total(Form::fixed_lag, false).refused, 1);
}

// And one of a P_0 of zeros, without disturbances: each node was f of the one before in doubles, and F expands.
TEST(IntervalGenerator, OnceWrongWhereAStateIsKnown) {
  Tally tally;
  fly_all(301, 116564, tally);
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print_wrong(form, false);
    EXPECT_EQ(tally.total(form, false).wrong() + tally.total(form, false).refused, 0) << name_of(form);
  }
}

// All of that kind (rounding/known_states.hpp): of 600 with two states 143 windows, 138 batches and 50 smoothers were
// wrong.
TEST(IntervalGenerator, KnownStatesOfExpandingModels) {
  Tally tally;
  for (std::uint64_t number = 0; number < 200; ++number) {
    with_size(number, [&]<int n, int p>() { fly_each<n, p>(make_known_states(number, n, p, false), tally); });
  }
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print(form, false);
    tally.print_wrong(form, false);
    const auto all = tally.total(form, false);
    EXPECT_EQ(all.wrong(), 0) << name_of(form);
    EXPECT_GT(all.problems - all.refused, 30) << name_of(form);
  }
}

// Level, slope and seven seasons: a flat start, of which P_s(1, 1) at the first instant lost a per cent.
TEST(IntervalGenerator, S10LevelSlopeAndSeasons) {
  constexpr int n = 8;
  Dynamics<double, n> model;
  model.F.setZero();
  model.F(0, 0) = model.F(0, 1) = model.F(1, 1) = 1;
  for (int j = 2; j < n; ++j) model.F(2, j) = -1;
  for (int i = 3; i < n; ++i) model.F(i, i - 1) = 1;
  model.G.setIdentity();
  model.Q.setZero();
  model.Q(0, 0) = 0.5;
  model.Q(1, 1) = 1e-3;
  model.Q(2, 2) = 0.02;
  Sensor<double, n, 1> row;
  row.H.setZero();
  row.H(0, 0) = row.H(0, 2) = 1;
  row.R(0, 0) = 0.1;
  const auto y = [](int k) {
    const double turn = 2 * 3.141592653589793 * k / 7;
    return 100 + 0.3 * k + 5 * std::sin(turn) + 2 * std::cos(2 * turn) + 0.2 * std::sin(11.3 * k);
  };
  const jml::Estimate<double, n> start{jml::Vector<double, n>::Zero(),
                                       1e6 * jml::Matrix<double, n, n>::Identity()};
  jml::Smoother smoother{jml::Filter{RuleOf<n>{}, model, start}, 59};
  ASSERT_EQ(smoother.update(row, y(0)).status, jml::Status::ok);
  for (int k = 1; k < 60; ++k) ASSERT_EQ(smoother.step(row, y(k)).status, jml::Status::ok) << k;
  ASSERT_EQ(smoother.smooth(), jml::Status::ok);
  EXPECT_NEAR(smoother.P(0)(1, 1), 0.0224358, 1e-7);
}

// What the x of a window lacks has no place in one that begins anew at its present: where that tells, it does not.
TEST(IntervalGenerator, AWindowThatIsKnownExactlyIsNotBegunAnewWithLess) {
  Dynamics<double, 2> drift;
  drift.F << 2, 3.1, 0, 1 - 12345679 * 0x1p-26;
  drift.G.setZero();
  drift.Q.setIdentity();
  const jml::Estimate<double, 2> start{jml::Vector<double, 2>(-3.1 / (1 + 12345679 * 0x1p-26), 1),
                                       jml::Matrix<double, 2, 2>::Zero()};
  jml::Filter lag{jml::FixedLag<4, 2>{{.tolerance = 1e-9}}, drift, sensor_list<double, 2, 1>(), start};
  for (int k = 0; k < 10; ++k) ASSERT_EQ(lag.predict(), jml::Status::ok) << k;
  const auto x = lag.x();
  EXPECT_EQ(lag.inflate({0, 0}), jml::Status::accuracy_not_met);
  EXPECT_EQ(lag.x(), x);
  EXPECT_EQ(lag.inflate({1, 1}), jml::Status::ok);  // an ε is nothing beside that
  EXPECT_EQ(lag.x(), x);
}

// A measurement of 1 to 1e-17: the nodes of a window or a batch have no such digits, and say so. A filter has, whose
// start was exact; and of one to 1e-10 its smoother too: x_0 + P_0 Fᵀ Hᵀ (1 - 13/30) / 3.
TEST(IntervalGenerator, FinerThanTheDigitsOfX) {
  Dynamics<double, 2> drift;
  drift.F << 1, 1, 0, 1;
  drift.G.setIdentity();
  drift.Q.setIdentity();
  Sensor<double, 2, 1> fine;
  fine.H << 1, 0;
  fine.R << 1e-34;
  const jml::Estimate<double, 2> start{jml::Vector<double, 2>(1.0 / 3, 0.1),
                                       jml::Matrix<double, 2, 2>::Identity()};
  const auto list = sensor_list<double, 2, 1>();

  jml::Filter lag{jml::FixedLag<4, 2>{{.tolerance = 1e-9}}, drift, list, start};
  EXPECT_EQ(lag.step(fine, 1.0).status, jml::Status::accuracy_not_met);
  EXPECT_EQ(lag.x(), start.x);
  EXPECT_EQ(lag.time(), 0);

  jml::Batch batch{drift, list, start, {.steps = 2, .measurements = 2}};
  EXPECT_EQ(batch.step(fine, 1.0).status, jml::Status::ok);
  EXPECT_EQ(batch.solve().status, jml::Status::accuracy_not_met);

  jml::Smoother smoother{jml::Filter{RuleOf<2>{}, drift, start}, 2};
  const auto report = smoother.step(fine, 1.0);
  EXPECT_EQ(report.status, jml::Status::ok);
  EXPECT_TRUE(report.redone);
  EXPECT_EQ(smoother.x()(0), 1);
  EXPECT_EQ(smoother.smooth(), jml::Status::covariance_lost);
  EXPECT_EQ(smoother.x(0), start.x);

  fine.R << 1e-20;
  jml::Smoother finer{jml::Filter{RuleOf<2>{}, drift, start}, 2};
  ASSERT_EQ(finer.step(fine, 1.0).status, jml::Status::ok);
  EXPECT_EQ(finer.smooth(), jml::Status::ok);
  EXPECT_NEAR(finer.x(0)(0), 47.0 / 90, 1e-13);
  EXPECT_NEAR(finer.x(0)(1), 26.0 / 90, 1e-13);

  // What was rounded before has not.
  jml::Smoother rounded{jml::Filter{RuleOf<2>{}, drift, start}, 3};
  ASSERT_EQ(rounded.predict(), jml::Status::ok);
  ASSERT_EQ(rounded.step(fine, 1.0).status, jml::Status::ok);
  EXPECT_EQ(rounded.smooth(), jml::Status::accuracy_not_met);
  EXPECT_EQ(rounded.x(0), start.x);
}

}  // namespace
