// SPDX-License-Identifier: BSD-3-Clause
// Images that somebody forged with the checksum right: refused, or the filter steps from any numbers to a
// status, and nothing is read or written where it should not be (which the sanitizers judge).
#include "pushed.hpp"

namespace {

using namespace flights;

template <std::size_t size>
void forge(std::array<std::byte, size>& image, Draw& draw) {
  for (int words = 1 + draw.below(3); words > 0; --words) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr double values[] = {infinity, -infinity, std::numeric_limits<double>::quiet_NaN(), -1, 0, 1e300,
                                 1e-310,   -1e-5};
    const std::size_t at =
        jml::detail::head_bytes + static_cast<std::size_t>(draw.below(size - jml::detail::frame_bytes - 8));
    const int kind = draw.below(4);
    if (kind == 0)
      image[at] = static_cast<std::byte>(draw.next());
    else if (kind == 1)
      jml::detail::put_bytes(&image[at], static_cast<std::uint64_t>(draw.below(12) - 2));
    else
      jml::detail::put_bytes(&image[at],
                             kind == 2 ? draw.next() : std::bit_cast<std::uint64_t>(values[draw.below(8)]));
  }
  jml::detail::end_image(image);
}

/// How many were taken, of `count`.
template <typename Filter>
int step_from_forged(Filter filter, int count) {
  Trace trace;
  for (int k = 1; k < 15; ++k) push<Seen>(filter, 3, k, trace, 0.01);
  jml::ImageOf<Filter> image;
  EXPECT_EQ(jml::save(image, filter), Status::ok);
  Draw draw(11, 0);
  int taken = 0;
  for (int i = 0; i < count; ++i) {
    auto bytes = image;
    forge(bytes, draw);
    const Status status = jml::restore(bytes, filter);
    if (status != Status::ok) {
      EXPECT_EQ(status, Status::damaged_image);
      continue;
    }
    ++taken;
    for (int k = 15; k < 19; ++k) push<Seen>(filter, static_cast<std::uint64_t>(i), k, trace, 0.01);
    trace.see(filter);
  }
  return taken;
}

TEST(ForgedImages, LeadToNothingUndefined) {
  const int count = by_night() ? 200'000 : 2000;
  EXPECT_GT(step_from_forged(jml::Filter{jml::Ekf{}, Pushed{}, pushed_start()}, count), count / 2);
  EXPECT_GT(step_from_forged(jml::Filter{jml::Factored{jml::Ekf{}}, Pushed{}, pushed_start()}, count),
            count / 2);
  EXPECT_GT(step_from_forged(
                jml::Filter{jml::Guaranteed{}, Driven{},
                            jml::Box<double, 2>{Vector<double, 2>(0.5, 0), Vector<double, 2>(1.2, 0.6)}},
                count),
            count / 2);
  EXPECT_GT(step_from_forged(
                jml::Filter{jml::Paved<4, 0>{}, Driven{},
                            jml::Box<double, 2>{Vector<double, 2>(0.5, 0), Vector<double, 2>(1.2, 0.6)}},
                count / 4),
            count / 8);
  EXPECT_GT(step_from_forged(
                jml::Filter{jml::FixedLag<4, 2>{}, Pushed{}, jml::sensors<jml::Part<Seen>>, pushed_start()},
                count / 4),
            count / 8);
}

}  // namespace
