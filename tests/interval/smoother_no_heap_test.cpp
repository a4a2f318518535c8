// SPDX-License-Identifier: BSD-3-Clause
// A smoother takes its memory when it is built, and never again: malloc and operator new are trapped.
#include <gtest/gtest.h>

#include <jml/interval/smoother.hpp>

#include "heap_trap.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using heap_trap::allocations, heap_trap::Armed;

template <typename Rule, typename D, typename S, int n, int p>
void expect_memory_of_construction_only(const Rule& rule, const D& d, const S& s,
                                        const jml::Estimate<double, n>& start,
                                        const jml::Vector<double, p>& y) {
  constexpr int capacity = 20;
  const jml::Filter filter{rule, d, start};
  Armed trap;
  jml::Smoother smoother{filter, capacity};
  const int at_construction = allocations;
  smoother.gate = {0.9999};
  jml::Vector<double, p> bad = y;
  bad(0) = std::nan("");
  int good = 0, full = 0, refused = 0, smoothed = 0;
  for (int i = 0; i < capacity; ++i) {
    const jml::Status step = i % 3 == 2 ? smoother.predict() : smoother.step(s, y).status;
    good += step == jml::Status::ok;
    good += smoother.update(s, y).status == jml::Status::ok;
    smoothed += smoother.smooth() == jml::Status::ok;
    refused += smoother.update(s, bad).status == jml::Status::invalid_measurement;
  }
  full += smoother.step(s, y).status == jml::Status::memory_full;
  full += smoother.predict() == jml::Status::memory_full;
  const bool again = smoother.reset(start, 0) == jml::Status::ok;
  good += smoother.step(s, y).status == jml::Status::ok;
  heap_trap::armed = false;
  EXPECT_EQ(at_construction, 2) << "once to see whether there is room, once to take it: the trap does not "
                                   "see the memory of the records";
  EXPECT_EQ(allocations, at_construction);
  EXPECT_EQ(good, 2 * capacity + 1);
  EXPECT_EQ(smoothed, capacity);
  EXPECT_EQ(refused, capacity);
  EXPECT_EQ(full, 2);
  EXPECT_TRUE(again);
}

TEST(SmootherNoHeap, VanDerPol) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  const jml::Vector<double, 1> y(0.6);
  expect_memory_of_construction_only(jml::Ekf{}, models::VanDerPol{}, models::SaturatingPosition{}, start, y);
  expect_memory_of_construction_only(jml::Sddre{}, models::VanDerPol{}, models::SaturatingPosition{}, start,
                                     y);
}

TEST(SmootherNoHeap, Radar) {
  jml::Estimate<double, 6> start;
  start.x << 40, 25, 12, -0.4, 0.1, 0.02;
  start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  const models::BallisticTarget d;
  const jml::Vector<double, 3> y = models::Radar{}.measurement(d.dynamics(start.x));
  expect_memory_of_construction_only(jml::Ekf{}, d, models::Radar{}, start, y);
}

}  // namespace
