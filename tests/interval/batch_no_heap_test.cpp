// SPDX-License-Identifier: BSD-3-Clause
// Batch takes its memory when it is built, and none after: malloc and operator new are trapped.
#include <gtest/gtest.h>

#include <jml/interval/batch.hpp>

#include "heap_trap.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using heap_trap::allocations, heap_trap::Armed;

TEST(BatchNoHeap, TheTrapWorks) {
  {
    Armed trap;
    const jml::Batch batch{
        models::VanDerPol{}, jml::sensors<models::SaturatingPosition>, jml::Estimate<double, 2>{}, {3}};
    EXPECT_EQ(batch.steps(), 0);
  }
  EXPECT_GE(allocations, 2);  // nodes and measurements
}

/// Fills a batch to the brim, one refused verb of each kind after it, and solves it in every way.
template <typename D, typename S, int n, int p>
void expect_no_allocation(const D& d, const S& s, const jml::Estimate<double, n>& prior,
                          const jml::Vector<double, p>& y) {
  constexpr int steps = 12;
  jml::Batch batch{d, jml::sensors<S>, prior, {.steps = steps, .measurements = steps}};
  int taken = 0, refused = 0, solved = 0, visited = 0;
  bool finite = true;
  {
    Armed trap;
    taken += batch.update(s, y) == jml::Status::ok;
    for (int k = 0; k < steps; ++k) {
      if (k == 5)
        taken += batch.predict() == jml::Status::ok;
      else
        taken += batch.step(s, y) == jml::Status::ok;
      batch.guess(prior.x);
      if (k == 3) solved += batch.solve().status == jml::Status::ok;
    }
    refused += batch.step(s, y) == jml::Status::memory_full;
    refused += batch.predict() == jml::Status::memory_full;
    refused += batch.update(s, y) == jml::Status::memory_full;
    for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
      for (const bool newton : {true, false}) {
        batch.start = start;
        batch.options.newton = newton;
        batch.options.loss = newton ? jml::Loss::huber(3) : jml::Loss{};
        solved += batch.solve().status == jml::Status::ok;
      }
    }
    batch.options.max_iterations = 0;
    refused += batch.solve().status == jml::Status::invalid_option;
    (void)batch.covariances([&](int, const auto& P) {
      finite = finite && jml::all_finite(P);
      ++visited;
    });
    finite = finite && jml::all_finite(batch.P(steps)) && jml::all_finite(batch.x(3)) &&
             jml::all_finite(batch.w(3)) && std::isfinite(batch.time(3));
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(taken, steps + 1);
  EXPECT_EQ(refused, 4);
  EXPECT_EQ(solved, 7);
  EXPECT_EQ(visited, steps + 1);
  EXPECT_TRUE(finite);
}

TEST(BatchNoHeap, VanDerPol) {
  const jml::Estimate<double, 2> prior{{1.2, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  expect_no_allocation(models::VanDerPol{}, models::SaturatingPosition{}, prior, jml::Vector<double, 1>(0.6));
}

TEST(BatchNoHeap, Radar) {
  jml::Estimate<double, 6> prior;
  prior.x << 40, 25, 12, -0.4, 0.1, 0.02;
  prior.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  expect_no_allocation(models::BallisticTarget{}, models::Radar{}, prior,
                       jml::Vector<double, 3>(models::Radar{}.measurement(prior.x)));
}

}  // namespace
