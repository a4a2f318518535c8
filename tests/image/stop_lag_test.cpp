// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere: a fixed lag with all its records, late measurements at a node and between two, a robust
// loss, and in factors with a start of which nothing is known.
#include "pushed.hpp"

namespace {

using namespace flights;

const auto push_seen = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  if (k % 25 == 0) filter.method().options.loss = jml::Loss::huber(1 + 0.01 * k);
  push<Seen>(filter, seed, k, trace);
};

TEST(StopAndGoOn, FixedLag) {
  int between = 0;
  stop_and_go_on(
      "fixed lag",
      [] {
        return jml::Filter{jml::FixedLag<5, 3>{}, Pushed{}, jml::sensors<jml::Part<Seen>>, pushed_start(),
                           2.0};
      },
      [&](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        const double first = filter.time(filter.depth());
        const int depth = filter.depth();
        const double now = filter.time();
        push_seen(filter, seed, k, trace);
        between += filter.time() == now && (filter.depth() > depth || filter.time(filter.depth()) > first);
      });
  EXPECT_GT(between, 10) << "no state was put in between two";
}

TEST(StopAndGoOn, FactoredFixedLag) {
  jml::Estimate<double, 2> start = pushed_start();
  start.P << 0.2, 0, 0, std::numeric_limits<double>::infinity();
  stop_and_go_on(
      "factored fixed lag",
      [&] {
        jml::Filter filter{jml::Factored{jml::FixedLag<4, 4>{}}, Pushed{}, jml::sensors<jml::Part<Seen>>,
                           start};
        filter.method().options.loss = jml::Loss::cauchy(2);
        filter.method().options.judge = true;
        return filter;
      },
      push_seen);
}

TEST(StopAndGoOn, BoundedFixedLag) {
  jml::Bounds<2> bounds;
  bounds.lower << -0.2, -0.3;
  bounds.upper << 0.3, 0.4;
  int held = 0;
  stop_and_go_on(
      "bounded fixed lag",
      [&] {
        return jml::Filter{jml::Bounded{jml::FixedLag<5, 3>{}, bounds}, Pushed{},
                           jml::sensors<jml::Part<Seen>>, pushed_start(), 2.0};
      },
      [&](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        push_seen(filter, seed, k, trace);
        held += filter.belief().multiplier()(0) != 0 || filter.belief().multiplier()(1) != 0;
      });
  EXPECT_GT(held, 100) << "no bound acted";
}

TEST(StopAndGoOn, DamagedWindowsAreRefused) {
  jml::Filter filter{jml::FixedLag<5, 3>{}, Pushed{}, jml::sensors<jml::Part<Seen>>, pushed_start(), 2.0};
  const auto fresh = filter;
  Trace trace;
  for (int k = 1; k < 40; ++k) push_seen(filter, 1, k, trace);
  refuse_damages(filter, fresh, damages() / 5);
}

}  // namespace
