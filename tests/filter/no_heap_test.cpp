// SPDX-License-Identifier: BSD-3-Clause
// No step of the core touches the heap: malloc and operator new are trapped, not read about.
#include <gtest/gtest.h>

#include <cstdlib>
#include <jml/jml.hpp>
#include <jml/model/discretize.hpp>

#include "heap_trap.hpp"
#include "models/dense.hpp"
#include "models/pendulum.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using heap_trap::allocations, heap_trap::Armed;

TEST(NoHeap, TheTrapWorks) {
  Armed trap;
  void* volatile block = std::malloc(8);
  std::free(block);
  EXPECT_EQ(allocations, 1);
}

template <typename Rule, typename D, typename S, int n, int p>
void expect_no_allocation(const Rule& rule, const D& d, const S& s, const jml::Estimate<double, n>& start,
                          const jml::Vector<double, p>& y) {
  int usable = 0, found = 0;
  {
    Armed trap;
    jml::Filter filter{rule, d, start};
    filter.gate = {0.9999};
    for (int i = 0; i < 5; ++i) {
      usable += jml::usable(filter.step(s, y).status);
      usable += jml::usable(filter.predict());
      usable += jml::usable(filter.update(s, y).status);
    }
    jml::Vector<double, p> bad = y;
    bad(0) = std::nan("");
    found = filter.step(s, bad).status == jml::Status::invalid_measurement;
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(usable, 0);
  EXPECT_EQ(found, 1);
}

template <typename D, typename S, int n, int p>
void every_rule(const D& d, const S& s, const jml::Estimate<double, n>& start,
                const jml::Vector<double, p>& y) {
  expect_no_allocation(jml::Ekf{}, d, s, start, y);
  expect_no_allocation(jml::Sddre{}, d, s, start, y);
  expect_no_allocation(jml::Jml{jml::AboutPoint{jml::Vector<double, n>(start.x * 0.9)}}, d, s, start, y);
  expect_no_allocation(jml::IteratedJml{}, d, s, start, y);
  expect_no_allocation(jml::IteratedJml{jml::IterationOptions{.method = jml::Iteration::none}}, d, s, start,
                       y);  // the fallback solver
}

TEST(NoHeap, VanDerPol) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  every_rule(models::VanDerPol{}, models::SaturatingPosition{}, start, jml::Vector<double, 1>(0.6));
  expect_no_allocation(jml::Iekf{}, models::VanDerPol{}, models::SaturatingPosition{}, start,
                       jml::Vector<double, 1>(0.6));
}

TEST(NoHeap, Radar) {
  jml::Estimate<double, 6> start;
  start.x << 40, 25, 12, -0.4, 0.1, 0.02;
  start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  const models::BallisticTarget d;
  every_rule(d, models::Radar{}, start,
             jml::Vector<double, 3>(models::Radar{}.measurement(d.dynamics(start.x))));
}

TEST(NoHeap, FifteenStates) {
  jml::Estimate<double, 15> start;
  start.x.setConstant(0.3);
  start.P = 0.1 * jml::Matrix<double, 15, 15>::Identity();
  const models::DenseDynamics<15> d;
  const models::DenseSensor<15, 6> s;
  const jml::Vector<double, 6> y = s.measurement(d.dynamics(start.x));
  expect_no_allocation(jml::Ekf{}, d, s, start, y);
  expect_no_allocation(jml::IteratedJml{jml::IterationOptions{.method = jml::Iteration::none}}, d, s, start,
                       y);
}

struct ContinuousPendulum {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    return {x(1), -9.81 * sin(x(0))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};

TEST(NoHeap, DiscretizedWithVanLoan) {
  const jml::Estimate<double, 2> start{{0.5, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  int usable = 0;
  {
    Armed trap;
    jml::Filter filter{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(ContinuousPendulum{}), start};
    for (int i = 0; i < 10; ++i) usable += jml::usable(filter.step(models::AngleSensor{}, 0.5, 0.01).status);
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(usable, 10);
}

}  // namespace
