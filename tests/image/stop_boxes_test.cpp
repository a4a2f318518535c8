// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere: boxes, with the zonotope and the last step that a guaranteed one remembers; and methods
// of one's own, which say nothing about images.
#include <write_your_own/consider_ekf.hpp>
#include <write_your_own/cubature.hpp>

#include "pushed.hpp"

namespace {

using namespace flights;

template <typename Rule>
auto boxed() {
  return jml::Filter{Rule{}, Driven{},
                     jml::Box<double, 2>{Vector<double, 2>(0.5, 0), Vector<double, 2>(1.2, 0.6)}};
}
/// A box that has drifted off the measurements begins anew.
const auto push_box = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  push<Seen>(filter, seed, k, trace, 0.02);
  if (k % 30 == 0)
    trace.add(filter.reset(jml::Box<double, 2>{Vector<double, 2>(-1.5, -1.5), Vector<double, 2>(1.5, 1.5)},
                           0.1 * k));
};

TEST(StopAndGoOn, Boxes) {
  stop_and_go_on("linearised", boxed<jml::Linearised>, push_box);
  stop_and_go_on("guaranteed", boxed<jml::Guaranteed<>>, push_box, [](const auto& filter) {
    return filter.belief().memory.stepped && filter.belief().memory.shaped ? 1 : 0;
  });
  stop_and_go_on("guaranteed, the box alone", boxed<jml::Guaranteed<0>>, push_box);
  stop_and_go_on("a union of boxes", boxed<jml::Paved<4>>, push_box,
                 [](const auto& filter) { return filter.parts().size() > 2 ? 1 : 0; });
}

TEST(StopAndGoOn, MethodsOfOnesOwn) {
  const auto push_seen = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
    push<Seen>(filter, seed, k, trace, 0.01);
  };
  stop_and_go_on(
      "cubature", [] { return jml::Filter{own::Cubature{}, Pushed{}, pushed_start()}; }, push_seen);
  stop_and_go_on(
      "considered states", [] { return jml::Filter{own::ConsiderEkf<1>{}, Pushed{}, pushed_start()}; },
      push_seen);
}

TEST(StopAndGoOn, DamagedBoxesAreRefused) {
  auto filter = boxed<jml::Guaranteed<>>();
  const auto fresh = filter;
  Trace trace;
  for (int k = 1; k < 20; ++k) push_box(filter, 1, k, trace);
  refuse_damages(filter, fresh, damages() / 5);
}

}  // namespace
