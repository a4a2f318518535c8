// SPDX-License-Identifier: BSD-3-Clause
// After its first step a filter on CVODE touches no heap, with Adams at once, with BDF after a warm-up:
// malloc and operator new are trapped.
#include <gtest/gtest.h>

#include <cstdlib>
#include <jml/continuous/cvode.hpp>

#include "heap_trap.hpp"
#include "models/continuous.hpp"

namespace {

using heap_trap::allocations, heap_trap::armed;

using jml::CvodeMethod;

int count(CvodeMethod method, int warm) {
  jml::Cvode cvode;
  cvode.method = method;
  const jml::Estimate<double, 2> start{{1, 0.5}, 0.001 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Filter filter{jml::Continuous{jml::Rnls{}, cvode}, models::Oscillator{}, start};
  const models::SaturatingSignal s;
  int good = 0;
  for (int i = 0; i < 40; ++i) {
    if (i == warm) {
      allocations = 0;
      armed = true;
    }
    good += filter.step(s, 0.6 + 0.001 * i, 0.01).status == jml::Status::ok;  // restarted
    good += filter.step(s, jml::Line{0.6 + 0.001 * i, 0.6}, 0.01).status == jml::Status::ok;
    good += filter.step(s, jml::Line{0.6, 0.61}, 0.01).status == jml::Status::ok;  // goes on
    good += filter.step(
                      s, [](double t) { return jml::Vector<double, 1>(0.6 + 0.1 * std::sin(t)); }, 0.01)
                .status == jml::Status::ok;
  }
  armed = false;
  EXPECT_EQ(good, 160);
  return allocations;
}

TEST(CvodeNoHeap, TheTrapWorks) { EXPECT_GT(count(CvodeMethod::adams, 0), 20); }
TEST(CvodeNoHeap, Adams) { EXPECT_EQ(count(CvodeMethod::adams, 1), 0); }
TEST(CvodeNoHeap, Bdf) { EXPECT_EQ(count(CvodeMethod::bdf, 3), 0); }

}  // namespace
