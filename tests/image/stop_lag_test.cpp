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

/// x_1² is seen, and the step bends: sweeps that lower J by less than they promise are damped.
struct Bent {
  static constexpr int states = 2, disturbances = 1, measurements = 1;
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x) const {
    using std::sin;
    return {0.95 * x(0) + 0.2 * sin(3.0 * x(1)) + 0.03 * x(0) * x(0), 0.95 * x(1) + 0.2 * sin(3.0 * x(0))};
  }
  static Matrix<double, 2, 1> disturbance_input() { return {0.3, -0.6}; }
  static Matrix<double, 1, 1> disturbance_covariance() { return Matrix<double, 1, 1>(0.05); }
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x) const {
    return Vector<T, 1>(x(0) * x(0) + 0.3 * x(1));
  }
  static Matrix<double, 1, 1> noise_covariance() { return Matrix<double, 1, 1>(1e-2); }
};
// A trajectory that is neither the nominal nor the trial is not saved, and says nothing.
TEST(StopAndGoOn, FixedLagThatIsDamped) {
  const jml::Estimate<double, 2> start{Vector<double, 2>(0.5, -0.5), Matrix<double, 2, 2>::Identity()};
  const auto make = [&] { return jml::Filter{jml::FixedLag<6>{}, Bent{}, jml::sensors<Bent>, start}; };
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    jml::Noise noise(seed);
    auto filter = make();
    for (int k = 0; k < 25; ++k) {
      jml::ImageOf<decltype(filter)> image;
      auto other = make();
      ASSERT_EQ(jml::save(image, filter), Status::ok);
      ASSERT_EQ(jml::restore(image, other), Status::ok);
      const Vector<double, 1> y(noise.uniform(-0.5, k % 10 == 9 ? 5 : 1));
      ASSERT_EQ(filter.step(Bent{}, y).status, other.step(Bent{}, y).status);
      ASSERT_EQ(filter.x(), other.x()) << "seed " << seed << ", step " << k;
    }
  }
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
