// SPDX-License-Identifier: BSD-3-Clause
// A filter is saved to plain bytes, as before a reset of its processor, and another one goes on from them,
// bit by bit.
#include <cstdio>
#include <jml/jml.hpp>

#include "models/van_der_pol.hpp"

namespace {

// [counters]
/// What stands beside the filter and has to come back too: a plain struct needs no word about images.
struct Counters {
  int used = 0, refused = 0;
};
// [/counters]

}  // namespace

int main() {
  using models::SaturatingPosition, models::VanDerPol;
  const jml::Estimate start{jml::Vector<double, 2>(1, 0), jml::Matrix<double, 2, 2>::Identity()};
  const auto make = [&] {
    return jml::Filter{jml::FixedLag<5>{}, VanDerPol{}, jml::sensors<SaturatingPosition>, start};
  };
  const auto y = [](int k) { return 0.7 * std::sin(0.1 * k); };

  auto filter = make();
  Counters counters;
  for (int k = 0; k < 20; ++k)
    ++(jml::usable(filter.step(SaturatingPosition{}, y(k)).status) ? counters.used : counters.refused);

  // [save]
  // A std::array of bytes, its size known at compile time: for a file, a flash page, another processor.
  jml::ImageOf<decltype(filter), Counters> image;
  if (jml::save(image, filter, counters) != jml::Status::ok) return 1;
  // [/save]

  auto restored = make();
  Counters again;
  image[100] ^= std::byte{1};
  std::printf("one bit of %zu bytes is wrong: %s\n", image.size(),
              describe(jml::restore(image, restored, again)));
  image[100] ^= std::byte{1};
  // [restore]
  const jml::Status status = jml::restore(image, restored, again);
  // [/restore]
  std::printf("and right again: %s\n", describe(status));

  for (int k = 20; k < 40; ++k) {
    if (!jml::usable(filter.step(SaturatingPosition{}, y(k)).status)) return 1;
    if (!jml::usable(restored.step(SaturatingPosition{}, y(k)).status)) return 1;
  }
  std::printf("twenty steps on: x = (%.17g, %.17g) and (%.17g, %.17g)\n", filter.x()(0), filter.x()(1),
              restored.x()(0), restored.x()(1));
  return status == jml::Status::ok && filter.x() == restored.x() && again.used == counters.used ? 0 : 1;
}
