// SPDX-License-Identifier: BSD-3-Clause
// CVODE as a filter's integrator: against the reference solutions, and at the poles of the Riccati equation.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/continuous/cvode.hpp>

#include "continuous/continuous_check.hpp"
#include "continuous/continuous_frozen.hpp"
#include "models/escaping.hpp"

namespace {

using namespace jml::operators;

using continuous_check::error;
using continuous_check::OscillatorCase;
using continuous_check::TimeVaryingCase;
using jml::Cvode;
using jml::CvodeMethod;
using jml::Status;
namespace reference = continuous_reference;

Cvode tight(CvodeMethod method) {
  Cvode c;
  c.method = method;
  c.relative_tolerance = 1e-12;
  c.absolute_tolerance = 1e-14;
  c.max_steps = 1000000;
  return c;
}
const Cvode adams = tight(CvodeMethod::adams), bdf = tight(CvodeMethod::bdf);

// Measured at worst: Adams 6e-11, BDF 9e-11 on the oscillator; 2e-12, 5e-11 on the time-varying example.
TEST(CvodeReference, Oscillator) {
  EXPECT_LT(error<OscillatorCase>(jml::Ekf{}, adams, OscillatorCase::ekf, 1), 1e-9);
  EXPECT_LT(error<OscillatorCase>(jml::Sddre{}, adams, OscillatorCase::sddre, 1), 1e-9);
  EXPECT_LT(error<OscillatorCase>(jml::Rnls{}, adams, OscillatorCase::rnls, 1), 1e-9);
  EXPECT_LT(error<OscillatorCase>(jml::Ekf{}, bdf, OscillatorCase::ekf, 1), 1e-8);
  EXPECT_LT(error<OscillatorCase>(jml::Sddre{}, bdf, OscillatorCase::sddre, 1), 1e-8);
  EXPECT_LT(error<OscillatorCase>(jml::Rnls{}, bdf, OscillatorCase::rnls, 1), 1e-8);
}
TEST(CvodeReference, TimeVarying) {
  EXPECT_LT(error<TimeVaryingCase>(jml::Ekf{}, adams, TimeVaryingCase::ekf, 1), 1e-9);
  EXPECT_LT(error<TimeVaryingCase>(jml::Sddre{}, adams, TimeVaryingCase::sddre, 1), 1e-9);
  EXPECT_LT(error<TimeVaryingCase>(jml::Rnls{}, adams, TimeVaryingCase::rnls, 1), 1e-9);
  EXPECT_LT(error<TimeVaryingCase>(jml::Ekf{}, bdf, TimeVaryingCase::ekf, 1), 1e-8);
  EXPECT_LT(error<TimeVaryingCase>(jml::Sddre{}, bdf, TimeVaryingCase::sddre, 1), 1e-8);
  EXPECT_LT(error<TimeVaryingCase>(jml::Rnls{}, bdf, TimeVaryingCase::rnls, 1), 1e-8);
}

/// Steps of dt until the first refusal.
template <typename D, typename S, int n, typename Y>
void expect_escape(const D& d, const S& s, const jml::Estimate<double, n>& start, const Y& y,
                   const Cvode& cvode, double dt, double pole) {
  SCOPED_TRACE(testing::Message() << "dt = " << dt
                                  << (cvode.method == CvodeMethod::bdf ? ", BDF" : ", Adams"));
  jml::Filter filter{jml::Continuous{jml::Rnls{}, cvode}, d, start};
  Status status = Status::ok;
  while (status == Status::ok && filter.time() < 3) {
    const auto before = filter.estimate();
    const double time = filter.time();
    status = filter.step(s, y, dt).status;
    if (status == Status::ok) continue;
    EXPECT_EQ(filter.x(), before.x);
    EXPECT_EQ(filter.P(), before.P);
    EXPECT_EQ(filter.time(), time);
  }
  EXPECT_EQ(status, Status::riccati_escape) << jml::describe(status);
  EXPECT_LT(filter.time(), pole);
  EXPECT_GT(filter.time(), pole - 1.5 * dt - 1e-4);
}
TEST(CvodeEscape, EveryCase) {
  using Square = jml::Matrix<double, 2, 2>;
  const jml::Vector<double, 1> one(1);
  const jml::Vector<double, 2> ones(1, 1);
  Cvode plain, stiff;
  stiff.method = CvodeMethod::bdf;
  Cvode fine = adams, fine_stiff = bdf;
  fine.max_steps = fine_stiff.max_steps = plain.max_steps;  // a step to the pole ends when these are used up
  for (const Cvode& cvode : {plain, stiff, fine, fine_stiff}) {
    for (const double dt : {0.001, 0.05, 0.3, 0.7, 2.0}) {
      expect_escape(models::EscapingCopies<1>{}, models::EscapingCopiesSensor<1>{},
                    jml::Estimate{one, jml::Matrix<double, 1, 1>(0.5)}, one, cvode, dt,
                    reference::escaping_copies_time);
      expect_escape(models::EscapingCopies<2>{}, models::EscapingCopiesSensor<2>{},
                    jml::Estimate{ones, 0.5 * Square::Identity()}, ones, cvode, dt,
                    reference::escaping_copies_time);
      expect_escape(models::EscapingPair{}, models::EscapingPairSensor{},
                    continuous_check::estimate_of(reference::escaping_pair_start), 0.328125, cvode, dt,
                    reference::escaping_pair_time);
    }
  }
}

TEST(CvodeEscape, HarmlessOnesRaiseNoAlarm) {
  jml::Noise noise(29);
  Cvode cvode;
  int harmless = 0;
  for (int k = 0; k < 1000; ++k) {
    const auto problem = continuous_frozen::random_problem<2, 1>(noise, 0.3);
    const auto wanted = continuous_frozen::solve(problem, 0.5);
    if (wanted.escaped || wanted.largest > 30) continue;
    ++harmless;
    cvode.method = k % 2 == 0 ? CvodeMethod::adams : CvodeMethod::bdf;
    jml::Filter filter{jml::Continuous{jml::Rnls{}, cvode}, problem.dynamics, problem.start};
    const Status status = filter.step(problem.sensor, problem.y, 0.5).status;
    EXPECT_EQ(status, Status::ok) << k << ": " << jml::describe(status);
    EXPECT_LT(continuous_frozen::distance(filter.estimate(), wanted), 1e-3) << k;
  }
  EXPECT_GT(harmless, 900);
}

// P(0) = 1e6, R = 1e-6, Q = 1, f = 0, by BDF: P = 1e-3 coth(1e3 t + artanh 1e-9).
TEST(CvodeEscape, StiffTransient) {
  continuous_frozen::Problem<1, 1> problem;
  problem.dynamics = {jml::Matrix<double, 1, 1>(0), jml::Matrix<double, 1, 1>(0),
                      jml::Matrix<double, 1, 1>(1), jml::Vector<double, 1>(0)};
  problem.sensor = {jml::Matrix<double, 1, 1>(1), jml::Matrix<double, 1, 1>(1),
                    jml::Matrix<double, 1, 1>(1e-6), jml::Vector<double, 1>(0)};
  Cvode cvode;
  cvode.method = CvodeMethod::bdf;
  cvode.absolute_tolerance = 1e-10;
  for (const double dt : {1e-3, 0.1, 1.0}) {
    jml::Filter filter{jml::Continuous{jml::Rnls{}, cvode}, problem.dynamics, jml::Estimate{jml::Vector<double, 1>(5), jml::Matrix<double, 1, 1>(1e6)}};
    const Status status = filter.step(problem.sensor, 2.0, dt).status;
    EXPECT_EQ(status, Status::ok) << jml::describe(status);
    EXPECT_NEAR(filter.P()(0, 0), 1e-3 / std::tanh(1e3 * dt), 1e-6);
  }
}

}  // namespace
