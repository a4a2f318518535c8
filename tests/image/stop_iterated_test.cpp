// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere: the iterated rules and their factored form; options that were changed in flight go along.
#include "pushed.hpp"

namespace {

using namespace flights;

const auto push_seen = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  if (k % 10 == 0) filter.method().options.max_iterations = 10 + k;
  push<Seen>(filter, seed, k, trace);
};

TEST(StopAndGoOn, IteratedRules) {
  stop_and_go_on("IEKF", [] { return jml::Filter{jml::Iekf{}, Pushed{}, pushed_start()}; }, push_seen);
  stop_and_go_on(
      "iterated JML", [] { return jml::Filter{jml::IteratedJml{}, Pushed{}, pushed_start()}; }, push_seen);
  stop_and_go_on(
      "factored IEKF", [] { return jml::Filter{jml::Factored{jml::Iekf{}}, Pushed{}, pushed_start()}; },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        push<Seen>(filter, seed, k, trace, 1e-11);
      },
      [](const auto& filter) { return filter.belief().extended ? 1 : 0; });
}

TEST(StopAndGoOn, OptionsChangedInFlightGoAlong) {
  jml::Filter filter{jml::IteratedJml{}, Pushed{}, pushed_start()}, other = filter;
  filter.method().options.method = jml::Iteration::picard;
  filter.method().options.tolerance = 1e-9;
  jml::ImageOf<decltype(filter)> image;
  ASSERT_EQ(jml::save(image, filter), Status::ok);
  ASSERT_EQ(jml::restore(image, other), Status::ok);
  EXPECT_EQ(other.method().options.method, jml::Iteration::picard);
  EXPECT_EQ(other.method().options.tolerance, 1e-9);
}

}  // namespace
