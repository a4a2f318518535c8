// SPDX-License-Identifier: BSD-3-Clause
// Runge-Kutta and Davison-Maki touch no heap, refusals and alarms included: malloc and operator new are
// trapped.
#include <gtest/gtest.h>

#include <cstdlib>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "heap_trap.hpp"
#include "models/continuous.hpp"
#include "models/escaping.hpp"
#include "models/time_varying.hpp"

namespace {

using namespace jml::operators;

using heap_trap::allocations, heap_trap::Armed;

TEST(ContinuousNoHeap, TheTrapWorks) {
  Armed trap;
  void* volatile block = std::malloc(8);
  std::free(block);
  EXPECT_EQ(allocations, 1);
}

template <typename Rule, typename D, typename S, int n, int p, typename Integrator>
void expect_none(const Rule& rule, const D& d, const S& s, const jml::Estimate<double, n>& start,
                 const jml::Vector<double, p>& y, double dt, const Integrator& integrator) {
  const jml::Vector<double, jml::DynamicsTraits<D>::controls> u =
      jml::Vector<double, jml::DynamicsTraits<D>::controls>::Constant(0.1);
  int good = 0, found = 0;
  {
    Armed trap;
    jml::Filter filter{jml::Continuous{rule, integrator}, d, start};
    for (int i = 0; i < 5; ++i) {
      good += filter.step(s, y, dt, u).status == jml::Status::ok;
      good += filter.step(s, jml::Line{y, y}, dt, u).status == jml::Status::ok;
      good += filter.step(s, [&](double) { return y; }, dt, u).status == jml::Status::ok;
      good += filter.predict(dt, u) == jml::Status::ok;
    }
    jml::Vector<double, p> bad = y;
    bad(0) = std::nan("");
    found = filter.step(s, bad, dt, u).status == jml::Status::invalid_measurement;
    found += filter.step(s, [&](double) { return bad; }, dt, u).status == jml::Status::invalid_measurement;
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(good, 20);
  EXPECT_EQ(found, 2);
}

template <typename Integrator>
void every_model() {
  jml::Estimate<double, 2> two{{1, 0.5}, 0.001 * jml::Matrix<double, 2, 2>::Identity()};
  expect_none(jml::Rnls{}, models::Oscillator{}, models::SaturatingSignal{}, two, jml::Vector<double, 1>(0.6),
              1e-3, Integrator{2});
  expect_none(jml::Ekf{}, models::Oscillator{}, models::SaturatingSignal{}, two, jml::Vector<double, 1>(0.6),
              1e-3, Integrator{});
  jml::Estimate<double, 3> three{{0.6, -0.4, 0.8}, 0.5 * jml::Matrix<double, 3, 3>::Identity()};
  expect_none(jml::Rnls{}, models::TimeVaryingPlant{}, models::TimeVaryingSensor{}, three,
              jml::Vector<double, 2>(0.3, 0.5), 1e-2, Integrator{});
  jml::Estimate<double, 6> six;
  six.x.setConstant(0.4);
  six.P = 1e-3 * jml::Matrix<double, 6, 6>::Identity();
  expect_none(jml::Rnls{}, models::OscillatorChain{}, models::SaturatingSignals{}, six,
              jml::Vector<double, 3>(0.3, 0.4, 0.5), 1e-3, Integrator{});
}
TEST(ContinuousNoHeap, RungeKutta) { every_model<jml::RungeKutta4>(); }
TEST(ContinuousNoHeap, DavisonMaki) { every_model<jml::DavisonMaki>(); }

TEST(ContinuousNoHeap, Escape) {
  const jml::Vector<double, 2> one(1, 1);
  int found = 0;
  {
    Armed trap;
    jml::Filter maki{jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}}, models::EscapingCopies<2>{}, jml::Estimate{one, 0.5 * jml::Matrix<double, 2, 2>::Identity()}};
    jml::Filter runge{jml::Continuous{jml::Rnls{}}, models::EscapingCopies<2>{}, jml::Estimate{one, 0.5 * jml::Matrix<double, 2, 2>::Identity()}};
    found += maki.step(models::EscapingCopiesSensor<2>{}, one, 1.0).status == jml::Status::riccati_escape;
    found += runge.step(models::EscapingCopiesSensor<2>{}, one, 1.0).status == jml::Status::riccati_escape;
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(found, 2);
}

}  // namespace
