// SPDX-License-Identifier: BSD-3-Clause
// CVODE keeps a history that no image holds: a restored filter starts afresh, whatever it was before, and
// goes on as the saved one does to what `ok` claims; bit by bit where that is restored from its own image,
// too.
#include <jml/continuous/cvode.hpp>

#include "pushed.hpp"

namespace {

using namespace flights;

auto made() {
  return jml::Filter{jml::Continuous{jml::Rnls{}, jml::Cvode{{.relative_tolerance = 1e-9}}}, Flowing{},
                     pushed_start(), 1.0};
}
/// Lines go on from each other, and CVODE with them; sometimes they jump, or a sample comes.
template <typename Filter>
void flow(Filter& filter, std::uint64_t seed, int k, Trace& trace) {
  Draw draw(seed, k);
  const double dt = draw.uniform(0.05, 0.15);
  const Vector<double, 1> u(k / 20 % 2 == 0 ? 0.5 : -0.5);
  const Seen sensor;
  const Vector<double, 2> y = pushed_y(sensor, k, draw);
  const double from = std::cos(0.1 * k), to = std::cos(0.1 * k + 0.1);
  const int verb = draw.below(12);
  if (verb == 0)
    trace.see_report(filter.update(sensor, y));
  else if (verb == 1)
    trace.see_report(filter.step(SeenAlways{}, y(0), dt, u));
  else
    trace.see_report(filter.step(SeenAlways{}, jml::Line{from, to}, dt, u));
}

TEST(StopAndGoOn, CvodeStartsAfresh) {
  const int stops = std::min(stop_points() / 3, 2000);
  auto other = made();
  int differ = 0, other_step = 0;
  for (int stop = 1; stop <= stops; ++stop) {
    const auto seed = static_cast<std::uint64_t>(stop);
    Draw draw(seed, -1);
    auto filter = made();
    Trace none;
    int k = 0;
    for (const int end = draw.below(12); k < end; ++k) flow(filter, seed, k, none);
    for (int more = draw.below(3); more > 0; --more) flow(other, 5, ++other_step, none);
    jml::ImageOf<decltype(filter)> image;
    ASSERT_EQ(jml::save(image, filter), Status::ok);
    auto copy = filter;
    ASSERT_EQ(jml::restore(image, other), Status::ok);
    ASSERT_EQ(jml::restore(image, copy), Status::ok);
    for (const int end = k + 4; k < end; ++k) {
      Trace of_copy, of_other, of_filter;
      flow(copy, seed, k, of_copy);
      flow(other, seed, k, of_other);
      flow(filter, seed, k, of_filter);
      of_copy.see(copy);
      of_other.see(other);
      ASSERT_EQ(of_copy, of_other) << "flight " << stop << ", step " << k;
      of_filter.see(filter);
      differ += !(of_filter == of_copy);
      ASSERT_LT((filter.x() - copy.x()).norm(), 1e-4) << "flight " << stop << ", step " << k;
      ASSERT_LT((filter.P() - copy.P()).norm(), 1e-4) << "flight " << stop << ", step " << k;
    }
  }
  EXPECT_GT(differ, 0) << "the history made no difference anywhere: then the original could be asked for";
}

}  // namespace
