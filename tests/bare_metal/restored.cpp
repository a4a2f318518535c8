// SPDX-License-Identifier: BSD-3-Clause
// A filter that is saved every twenty steps and goes on in another one, beside the one that was never
// stopped: the run fails at the first bit that differs.
#include <bit>

#include "trajectory.hpp"

namespace bare_metal {
namespace {

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// `checksum`: of the image of the filter as it starts, on the host: every byte of it is the same here, so
/// that what one of them saves the other restores.
template <typename Filter>
bool run_restored(Filter filter, std::uint64_t checksum, const double (&y)[steps], Table& table) {
  Filter first = filter, second = filter;
  jml::ImageOf<Filter> image;
  if (jml::save(image, filter) != jml::Status::ok) return false;
  if (jml::detail::get_bytes(image.data() + image.size() - 8) != checksum) return false;
  int i = 0;
  bool same = true;
  const bool usable = keep(
      filter, y, table,
      [&](double sample) {
        const models::SaturatingPosition sensor;
        Filter& restored = i / 20 % 2 == 0 ? first : second;
        if (i % 20 == 0) {
          // Damaged at first, and refused here too.
          same = same && jml::save(image, filter) == jml::Status::ok;
          image[40] ^= std::byte{1};
          same = same && jml::restore(image, restored) == jml::Status::damaged_image;
          image[40] ^= std::byte{1};
          same = same && jml::restore(image, restored) == jml::Status::ok;
        }
        ++i;
        const auto report = filter.step(sensor, sample);
        same = same && restored.step(sensor, sample).status == report.status;
        for (int k = 0; k < 2; ++k) same = same && same_bits(filter.x()(k), restored.x()(k));
        return report;
      },
      [&] { return filter.P(); });
  return usable && same;
}

}  // namespace

bool restored_ekf(const double (&y)[steps], Table& table) {
  return run_restored(jml::Filter{jml::Ekf{}, models::VanDerPol{}, start<double>()}, 0xF66141EED3AC685C, y,
                      table);
}
bool restored_lag(const double (&y)[steps], Table& table) {
  return run_restored(jml::Filter{jml::FixedLag<4>{}, models::VanDerPol{},
                                  jml::sensors<models::SaturatingPosition>, start<double>()},
                      0x6BAE006CC7FD7716, y, table);
}

}  // namespace bare_metal
