// SPDX-License-Identifier: BSD-3-Clause
// The fixed-step integrators against the reference solutions, and their orders of convergence.
#include <gtest/gtest.h>

#include "continuous/continuous_check.hpp"

namespace {

using continuous_check::error;
using continuous_check::order;
using continuous_check::OscillatorCase;
using continuous_check::TimeVaryingCase;
using jml::DavisonMaki;
using jml::RungeKutta4;

// Over 20 s, every row of Table 1. Measured with RungeKutta4, 0.156 ms a step: 3e-14 (EKF), 1.2e-12 (SDDRE),
// 2e-13 (RNLS); with DavisonMaki, 0.0195 ms: 5e-9, 8e-9, 7e-9, which is its order, not its rounding.
TEST(ContinuousReference, OscillatorByRungeKutta) {
  EXPECT_LT(error<OscillatorCase>(jml::Ekf{}, RungeKutta4{64}, OscillatorCase::ekf, 100), 1e-11);
  EXPECT_LT(error<OscillatorCase>(jml::Sddre{}, RungeKutta4{64}, OscillatorCase::sddre, 100), 1e-11);
  EXPECT_LT(error<OscillatorCase>(jml::Rnls{}, RungeKutta4{64}, OscillatorCase::rnls, 100), 1e-11);
}
TEST(ContinuousReference, OscillatorByDavisonMaki) {
  EXPECT_LT(error<OscillatorCase>(jml::Ekf{}, DavisonMaki{512}, OscillatorCase::ekf, 100), 1e-8);
  EXPECT_LT(error<OscillatorCase>(jml::Sddre{}, DavisonMaki{512}, OscillatorCase::sddre, 100), 1e-8);
  EXPECT_LT(error<OscillatorCase>(jml::Rnls{}, DavisonMaki{512}, OscillatorCase::rnls, 100), 1e-8);
}

// Time, control, two correlated measurements. Measured: 5e-13 at 0.39 ms; 7e-9 at 0.098 ms.
TEST(ContinuousReference, TimeVaryingByRungeKutta) {
  EXPECT_LT(error<TimeVaryingCase>(jml::Ekf{}, RungeKutta4{256}, TimeVaryingCase::ekf, 10), 1e-11);
  EXPECT_LT(error<TimeVaryingCase>(jml::Sddre{}, RungeKutta4{256}, TimeVaryingCase::sddre, 10), 1e-11);
  EXPECT_LT(error<TimeVaryingCase>(jml::Rnls{}, RungeKutta4{256}, TimeVaryingCase::rnls, 10), 1e-11);
}
TEST(ContinuousReference, TimeVaryingByDavisonMaki) {
  EXPECT_LT(error<TimeVaryingCase>(jml::Ekf{}, DavisonMaki{1024}, TimeVaryingCase::ekf, 10), 1e-8);
  EXPECT_LT(error<TimeVaryingCase>(jml::Sddre{}, DavisonMaki{1024}, TimeVaryingCase::sddre, 10), 1e-8);
  EXPECT_LT(error<TimeVaryingCase>(jml::Rnls{}, DavisonMaki{1024}, TimeVaryingCase::rnls, 10), 1e-8);
}

// The transient at the start of the chapter's example has rates of 200 /s: the order shows below 1 ms a step.
template <typename Case, typename Integrator, typename Rule, typename Samples>
void expect_order(const Rule& rule, const Samples& samples, int per_second, int substeps, double expected,
                  double tolerance) {
  const double coarse = error<Case>(rule, Integrator{substeps}, samples, per_second);
  const double middle = error<Case>(rule, Integrator{2 * substeps}, samples, per_second);
  const double fine = error<Case>(rule, Integrator{4 * substeps}, samples, per_second);
  EXPECT_NEAR(order(coarse, middle, 2), expected, tolerance) << coarse << " " << middle;
  EXPECT_NEAR(order(middle, fine, 2), expected, tolerance) << middle << " " << fine;
}

TEST(ContinuousOrder, RungeKuttaIsOfOrderFour) {
  expect_order<OscillatorCase, RungeKutta4>(jml::Ekf{}, OscillatorCase::ekf, 100, 8, 4, 0.15);
  expect_order<OscillatorCase, RungeKutta4>(jml::Sddre{}, OscillatorCase::sddre, 100, 8, 4, 0.15);
  expect_order<OscillatorCase, RungeKutta4>(jml::Rnls{}, OscillatorCase::rnls, 100, 8, 4, 0.15);
  expect_order<TimeVaryingCase, RungeKutta4>(jml::Ekf{}, TimeVaryingCase::ekf, 10, 64, 4, 0.15);
  expect_order<TimeVaryingCase, RungeKutta4>(jml::Sddre{}, TimeVaryingCase::sddre, 10, 64, 4, 0.15);
  expect_order<TimeVaryingCase, RungeKutta4>(jml::Rnls{}, TimeVaryingCase::rnls, 10, 64, 4, 0.15);
}

TEST(ContinuousOrder, DavisonMakiIsOfOrderTwo) {
  expect_order<OscillatorCase, DavisonMaki>(jml::Ekf{}, OscillatorCase::ekf, 100, 2, 2, 0.1);
  expect_order<OscillatorCase, DavisonMaki>(jml::Sddre{}, OscillatorCase::sddre, 100, 2, 2, 0.1);
  expect_order<OscillatorCase, DavisonMaki>(jml::Rnls{}, OscillatorCase::rnls, 100, 2, 2, 0.1);
  expect_order<TimeVaryingCase, DavisonMaki>(jml::Ekf{}, TimeVaryingCase::ekf, 10, 16, 2, 0.1);
  expect_order<TimeVaryingCase, DavisonMaki>(jml::Sddre{}, TimeVaryingCase::sddre, 10, 16, 2, 0.1);
  expect_order<TimeVaryingCase, DavisonMaki>(jml::Rnls{}, TimeVaryingCase::rnls, 10, 16, 2, 0.1);
}

// The interval between two calls and the substeps in it are the same thing to a smooth y(t).
TEST(ContinuousReference, IntervalsAndSubstepsAreInterchangeable) {
  const double once = error<OscillatorCase>(jml::Rnls{}, RungeKutta4{80}, OscillatorCase::rnls, 20, 2);
  const double split = error<OscillatorCase>(jml::Rnls{}, RungeKutta4{4}, OscillatorCase::rnls, 400, 2);
  EXPECT_NEAR(once, split, 1e-12);  // rounding; both 5e-11
  EXPECT_LT(once, 1e-9);
}

}  // namespace
