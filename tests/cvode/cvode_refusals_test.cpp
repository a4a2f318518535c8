// SPDX-License-Identifier: BSD-3-Clause
// What CVODE refuses has the core's names, leaves the filter untouched and prints nothing; and what a filter
// keeps of it is its own.
#include <gtest/gtest.h>

#include <jml/continuous/cvode.hpp>
#include <thread>

#include "continuous/continuous_check.hpp"
#include "continuous/continuous_faulty.hpp"

namespace {

using namespace continuous_faulty;
using jml::Cvode;
using jml::CvodeMethod;
using jml::Status;

class CvodeRefusals : public testing::TestWithParam<CvodeMethod> {
 protected:
  void SetUp() override {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
  }
  void TearDown() override {
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }
  static Cvode options() {
    Cvode c;
    c.method = GetParam();
    return c;
  }
  template <typename Step>
  static void expect(const Cvode& cvode, const Plant& plant, const Step& step, Status wanted,
                     bool late = false) {
    jml::Filter filter{jml::Continuous{jml::Rnls{}, cvode}, plant, start(), 3.0};
    const Status got = step(filter);
    EXPECT_TRUE(got == wanted || (late && got != Status::ok))
        << jml::describe(got) << "; wanted: " << jml::describe(wanted);
    EXPECT_EQ(filter.x(), start().x);
    EXPECT_EQ(filter.P(), start().P);
    EXPECT_EQ(filter.time(), 3);
  }
};
INSTANTIATE_TEST_SUITE_P(Methods, CvodeRefusals, testing::Values(CvodeMethod::adams, CvodeMethod::bdf));

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST_P(CvodeRefusals, Inputs) {
  const auto with = [](const auto& signal, double dt, double control) {
    return [signal, dt, control](auto& f) {
      return f.step(Sensor{}, signal, dt, jml::Vector<double, 1>(control)).status;
    };
  };
  const jml::Vector<double, 2> bad(0, nan);
  expect(options(), {}, with(bad, 0.1, 0.2), Status::invalid_measurement);
  expect(options(), {}, with(jml::Line{y, bad}, 0.1, 0.2), Status::invalid_measurement);
  expect(options(), {}, with([bad](double) { return bad; }, 0.1, 0.2), Status::invalid_measurement);
  expect(options(), {}, with(y, -1e-3, 0.2), Status::invalid_time_step);
  expect(options(), {}, with(y, nan, 0.2), Status::invalid_time_step);
  expect(options(), {}, with(y, 0.1, nan), Status::invalid_control);
}

TEST_P(CvodeRefusals, Models) {
  const auto step = [](const Sensor& s) { return [s](auto& f) { return f.step(s, y, 0.1, u).status; }; };
  for (const double since : {-1.0, 3.04}) {
    for (const auto& [fault, status] : of_plant) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(fault) << " since " << since);
      expect(options(), Plant{fault, since}, step({}), status,
             since > 3);  // then its source is not looked for
    }
    for (const auto& [fault, status] : of_sensor) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(fault) << " since " << since);
      expect(options(), {}, step({fault, since}), status, since > 3);
    }
  }
}

TEST_P(CvodeRefusals, Options) {
  const auto step = [](auto& f) { return f.step(Sensor{}, y, 1.0, u).status; };
  const auto with = [&](auto member, auto value) {
    Cvode c = options();
    c.*member = value;
    return c;
  };
  for (const double bad : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    expect(with(&Cvode::relative_tolerance, bad), {}, step, Status::invalid_option);
    expect(with(&Cvode::absolute_tolerance, bad), {}, step, Status::invalid_option);
    expect(with(&Cvode::first_step, bad), {}, step, Status::invalid_option);
    expect(with(&Cvode::min_step, bad), {}, step, Status::invalid_option);
    expect(with(&Cvode::max_step, bad), {}, step, Status::invalid_option);
  }
  expect(with(&Cvode::max_steps, 0), {}, step, Status::invalid_option);
  expect(with(&Cvode::max_steps, 1), {}, step, Status::step_limit);
  Cvode none = options();
  none.relative_tolerance = none.absolute_tolerance = 0;
  expect(none, {}, step, Status::invalid_option);
  Cvode crossed = options();
  crossed.min_step = 0.1;
  crossed.max_step = 0.01;
  expect(crossed, {}, step, Status::invalid_option);
  Cvode impossible = options();
  impossible.relative_tolerance = impossible.absolute_tolerance = 1e-18;
  expect(impossible, {}, step, Status::accuracy_not_met);
}

TEST_P(CvodeRefusals, GoesOnAfterwards) {
  jml::Filter filter{jml::Continuous{jml::Rnls{}, options()}, Plant{}, start()}, other = filter;
  EXPECT_EQ(filter.step(Sensor{}, y, 0.1, u).status, Status::ok);
  EXPECT_NE(filter.step(Sensor{Fault::m, 0.15}, y, 0.1, u).status, Status::ok);
  EXPECT_EQ(filter.step(Sensor{}, y, 0.1, u).status, Status::ok);
  EXPECT_EQ(other.step(Sensor{}, y, 0.1, u).status, Status::ok);
  EXPECT_EQ(other.step(Sensor{}, y, 0.1, u).status, Status::ok);
  EXPECT_LT((filter.P() - other.P()).norm(), 1e-5);
}

TEST_P(CvodeRefusals, ZeroAndTinyStepsAreFine) {
  jml::Filter filter{jml::Continuous{jml::Rnls{}, options()}, Plant{}, start(), 3.0};
  EXPECT_EQ(filter.step(Sensor{}, y, 0.0, u).status, Status::ok);
  EXPECT_EQ(filter.P(), start().P);
  for (const double dt : {1e-320, 1e-17, 1e-15, 1e-12}) {
    const auto report = filter.step(Sensor{}, y, dt, u);
    EXPECT_EQ(report.status, Status::ok) << dt << jml::describe(report.status);
  }
  EXPECT_LT((filter.P() - start().P).norm(), 1e-11);
  EXPECT_EQ(filter.step(Sensor{}, y, 0.1, u).status, Status::ok);
}

// Every return code of CVode() and of the calls before it, and the Status it is documented to be.
TEST(CvodeStatus, OfEveryCode) {
  for (const int code : {CV_SUCCESS, CV_TSTOP_RETURN, CV_ROOT_RETURN, CV_WARNING})
    EXPECT_EQ(jml::cvode_status(code), Status::ok);
  EXPECT_EQ(jml::cvode_status(CV_TOO_MUCH_WORK), Status::step_limit);
  for (const int code : {CV_TOO_MUCH_ACC, CV_ERR_FAILURE, CV_CONV_FAILURE}) {
    EXPECT_EQ(jml::cvode_status(code, Status::ok), Status::accuracy_not_met);
    EXPECT_EQ(jml::cvode_status(code, Status::riccati_escape), Status::riccati_escape);
  }
  for (const int code : {CV_RHSFUNC_FAIL, CV_FIRST_RHSFUNC_ERR, CV_REPTD_RHSFUNC_ERR, CV_UNREC_RHSFUNC_ERR}) {
    EXPECT_EQ(jml::cvode_status(code, Status::ok), Status::dynamics_not_finite);
    EXPECT_EQ(jml::cvode_status(code, Status::invalid_noise_covariance), Status::invalid_noise_covariance);
  }
  EXPECT_EQ(jml::cvode_status(CV_ILL_INPUT), Status::invalid_option);
  for (const int code : {CV_TOO_CLOSE, CV_BAD_T})
    EXPECT_EQ(jml::cvode_status(code), Status::invalid_time_step);
  for (const int code : {CV_LINIT_FAIL, CV_LSETUP_FAIL, CV_LSOLVE_FAIL, CV_RTFUNC_FAIL, CV_NLS_INIT_FAIL,
                         CV_NLS_SETUP_FAIL, CV_CONSTR_FAIL, CV_NLS_FAIL, CV_MEM_FAIL, CV_MEM_NULL,
                         CV_NO_MALLOC, CV_BAD_K, CV_BAD_DKY, CV_VECTOROP_ERR, CV_UNRECOGNIZED_ERR, -9999})
    EXPECT_EQ(jml::cvode_status(code), Status::integrator_failed) << code;
}

// ---- what is kept from interval to interval

using Case = continuous_check::OscillatorCase;
auto oscillator(const Cvode& cvode = {}) {
  return jml::Filter{jml::Continuous{jml::Rnls{}, cvode}, models::Oscillator{}, Case::start()};
}
template <typename Filter>
long warm_up(Filter& filter,
             double value) {  // 50 intervals of 10 ms that end at `value`; evaluations of the last
  long evaluations = 0;
  for (int i = 0; i < 50; ++i)
    evaluations = filter.step(models::SaturatingSignal{}, jml::Line{value, value}, 0.01).evaluations;
  return evaluations;
}

TEST(CvodeRestarts, OnlyWhereSomethingJumps) {
  const models::SaturatingSignal s;
  for (const CvodeMethod method : {CvodeMethod::adams, CvodeMethod::bdf}) {
    Cvode cvode;
    cvode.method = method;
    auto filter = oscillator(cvode);
    const long going_on = warm_up(filter, 0.6);
    EXPECT_LE(going_on, 4);
    EXPECT_GE(filter.step(s, jml::Line{0.7, 0.7}, 0.01).evaluations, 2 * going_on + 3);  // a jump
    warm_up(filter, 0.7);
    EXPECT_EQ(filter.update(models::SaturatingPosition{}, 0.7).status, Status::ok);
    EXPECT_GE(filter.step(s, jml::Line{0.7, 0.7}, 0.01).evaluations,
              2 * going_on + 3);  // an estimate that changed
    warm_up(filter, 0.7);
    EXPECT_EQ(filter.reset(Case::start(), filter.time()), Status::ok);
    EXPECT_GE(filter.step(s, jml::Line{0.7, 0.7}, 0.01).evaluations, 2 * going_on + 3);
  }
}

// The same smooth y(t), as lines between its samples and held.
TEST(CvodeRestarts, LinesAreCheaperThanHeldValues) {
  Cvode cvode;
  cvode.relative_tolerance = 1e-6;  // the kinks between lines count for more with less
  auto lines = oscillator(cvode), held = oscillator(cvode);
  long by_lines = 0, by_held = 0;
  for (int i = 0; i < 500; ++i) {
    const double now = Case::y(0.01 * i)(0), next = Case::y(0.01 * (i + 1))(0);
    const auto line = lines.step(models::SaturatingSignal{}, jml::Line{now, next}, 0.01);
    const auto hold = held.step(models::SaturatingSignal{}, now, 0.01);
    ASSERT_EQ(line.status, Status::ok);
    ASSERT_EQ(hold.status, Status::ok);
    by_lines += line.evaluations;
    by_held += hold.evaluations;
  }
  EXPECT_LT(by_lines * 4, by_held) << by_lines << " against " << by_held;
}

TEST(CvodeRestarts, HeldValuesThatDoNotChangeGoOn) {
  auto filter = oscillator();
  long evaluations = 0;
  for (int i = 0; i < 50; ++i) evaluations = filter.step(models::SaturatingSignal{}, 0.6, 0.01).evaluations;
  EXPECT_LE(evaluations, 4);
  EXPECT_GT(filter.step(models::SaturatingSignal{}, 0.65, 0.01).evaluations, 7);
}

TEST(CvodeRestarts, ControlJumps) {
  Cvode cvode;
  cvode.relative_tolerance = 1e-9;
  jml::Filter going{jml::Continuous{jml::Rnls{}, cvode}, Plant{}, start()};
  for (int i = 0; i < 20; ++i) ASSERT_EQ(going.step(Sensor{}, y, 0.05, u).status, Status::ok);
  const long kept = going.step(Sensor{}, y, 0.05, u).evaluations;
  const long jumped = going.step(Sensor{}, y, 0.05, -u).evaluations;
  EXPECT_GT(jumped, 2 * kept);
}

// Going on and starting afresh are the same to the tolerance.
TEST(CvodeRestarts, AgreesWithFreshFilters) {
  Cvode cvode;
  cvode.relative_tolerance = 1e-10;
  cvode.absolute_tolerance = 1e-12;
  auto going = oscillator(cvode);
  auto fresh = Case::start();
  double last = Case::y(0)(0);
  for (int i = 0; i < 200; ++i) {
    const double next = Case::y(0.01 * (i + 1))(0);
    ASSERT_EQ(going.step(models::SaturatingSignal{}, jml::Line{last, next}, 0.01).status, Status::ok);
    jml::Filter once{jml::Continuous{jml::Rnls{}, cvode}, models::Oscillator{}, fresh, 0.01 * i};
    ASSERT_EQ(once.step(models::SaturatingSignal{}, jml::Line{last, next}, 0.01).status, Status::ok);
    fresh = once.estimate();
    last = next;
  }
  EXPECT_LT(continuous_check::distance(going.estimate(), fresh), 1e-8);
}

TEST(CvodeCopies, AreIndependent) {
  auto one = oscillator();
  for (int i = 0; i < 10; ++i) ASSERT_EQ(one.step(models::SaturatingSignal{}, 0.5, 0.01).status, Status::ok);
  auto copy = one;
  const auto before = copy.estimate();
  for (int i = 0; i < 10; ++i) ASSERT_EQ(one.step(models::SaturatingSignal{}, 0.9, 0.01).status, Status::ok);
  EXPECT_EQ(copy.P(), before.P);
  auto twin = copy;
  for (int i = 0; i < 10; ++i) ASSERT_EQ(copy.step(models::SaturatingSignal{}, 0.9, 0.01).status, Status::ok);
  EXPECT_LT(continuous_check::distance(copy.estimate(), one.estimate()), 1e-5);
  twin = copy;
  ASSERT_EQ(copy.step(models::SaturatingSignal{}, 0.8, 0.01).status, Status::ok);
  ASSERT_EQ(twin.step(models::SaturatingSignal{}, 0.8, 0.01).status, Status::ok);
  EXPECT_EQ(copy.P(), twin.P());
  auto moved = std::move(twin);
  EXPECT_EQ(moved.step(models::SaturatingSignal{}, 0.8, 0.01).status, Status::ok);
}

jml::Matrix<double, 2, 2> long_run(int k) {
  Cvode cvode;
  cvode.method = k % 2 == 0 ? CvodeMethod::adams : CvodeMethod::bdf;
  auto filter = oscillator(cvode);
  for (int i = 0; i < 100; ++i) {
    if (filter.step(models::SaturatingSignal{}, 0.5 + 0.01 * k + 0.001 * (i % 7), 0.01).status != Status::ok)
      return {};
  }
  return filter.P();
}
TEST(CvodeThreads, SameBitsAsOne) {
  constexpr int count = 20;
  std::vector<jml::Matrix<double, 2, 2>> alone(count), together(count);
  for (int k = 0; k < count; ++k) alone[k] = long_run(k);
  const auto half = [&](int first) {
    for (int k = first; k < count; k += 2) together[k] = long_run(k);
  };
  std::thread one(half, 0), two(half, 1);
  one.join();
  two.join();
  for (int k = 0; k < count; ++k) EXPECT_EQ(alone[k], together[k]);
}

}  // namespace
