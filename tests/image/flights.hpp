// SPDX-License-Identifier: BSD-3-Clause
// Flights that stop anywhere and go on from an image: what the restored filter shows afterwards is what the
// other one shows, bit by bit.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <memory>
#include <vector>

#include "by_night.hpp"

namespace flights {

using jml::Vector, jml::Matrix, jml::Status;

/// Of every method.
inline int stop_points() { return by_night() ? 10'000 : 300; }
inline int damages() { return by_night() ? 1'000'000 : 100'000; }

/// The bits of all that a filter and its reports show.
class Trace {
 public:
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(float number) { add(static_cast<double>(number)); }
  void add(int number) { add(static_cast<std::uint64_t>(number)); }
  void add(long number) { add(static_cast<std::uint64_t>(number)); }
  void add(bool flag) { add(std::uint64_t(flag)); }
  void add(jml::Status status) { add(static_cast<int>(status)); }
  void add(std::uint64_t word) {
    hash_ = (hash_ ^ word) * 0x9E3779B97F4A7C15U;
    hash_ ^= hash_ >> 29U;
  }
  template <typename Derived>
  void add(const Eigen::MatrixBase<Derived>& matrix) {
    const typename Derived::PlainObject value = matrix;
    for (int i = 0; i < value.size(); ++i) add(value.data()[i]);
  }
  template <typename Filter>
  void see(const Filter& filter) {
    add(filter.x());
    add(filter.time());
    add(filter.status());
    if constexpr (requires { filter.P(); }) add(filter.P());
    if constexpr (requires { filter.belief().spread; }) {
      add(filter.belief().spread);
      add(filter.belief().exact);
      add(filter.belief().fine);
    }
    if constexpr (requires { filter.belief().magnification; }) {
      add(filter.belief().magnification);
      add(filter.belief().variances);
    }
    if constexpr (requires { filter.box(); }) {
      add(filter.box().lower);
      add(filter.box().upper);
    }
    if constexpr (requires { filter.depth(); }) {
      add(filter.depth());
      for (int age = 0; age <= filter.depth(); ++age) {
        add(filter.x(age));
        add(filter.time(age));
      }
      add(filter.P(filter.depth() / 2));
    }
  }
  template <typename Report>
  void see_report(const Report& report) {
    add(report.status);
    add(report.innovation);
    if constexpr (requires { report.gain; }) add(report.gain);
    if constexpr (requires { report.innovation_matrix; }) add(report.innovation_matrix);
    if constexpr (requires { report.iterations; }) add(report.iterations);
    if constexpr (requires { report.sweeps; }) add(report.sweeps);
    if constexpr (requires { report.cost; }) add(report.cost);
    if constexpr (requires { report.redone; }) add(report.redone);
    if constexpr (requires { report.solutions; }) add(report.solutions);
  }
  friend bool operator==(const Trace&, const Trace&) = default;

 private:
  std::uint64_t hash_ = 0;
};

/// Numbers of step k of flight `seed`: the same whoever asks.
struct Draw {
  std::uint64_t state;
  Draw(std::uint64_t seed, int k) : state(seed * 1000003U + static_cast<std::uint64_t>(k)) { (void)next(); }
  std::uint64_t next() {
    std::uint64_t z = state += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11U) * 0x1p-53);
  }
  int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
};

/// make(): a filter; advance(filter, seed, k, trace): one verb, whose inputs follow from seed and k. The
/// filter that an image is restored into has flown another way before. `sight(filter)`: what the flights must
/// have seen somewhere.
template <typename Make, typename Advance, typename Sight>
void stop_and_go_on(const char* name, const Make& make, const Advance& advance, const Sight& sight) {
  SCOPED_TRACE(name);
  using Filter = decltype(make());
  constexpr int length = 100, most_ahead = 12;
  const auto image = std::make_unique<std::vector<jml::ImageOf<Filter>>>(length + 1);
  const auto again = std::make_unique<jml::ImageOf<Filter>>();
  const auto other = std::make_unique<Filter>(make());
  int stops = 0, seen = 0, other_step = 0;
  for (std::uint64_t seed = 1; stops < stop_points(); ++seed) {
    std::vector<Trace> shown(length + 1);
    const auto filter = std::make_unique<Filter>(make());
    for (int k = 0; k <= length; ++k) {
      if (k > 0) advance(*filter, seed, k, shown[k]);
      shown[k].see(*filter);
      ASSERT_EQ(jml::save((*image)[k], *filter), Status::ok);
      seen += sight(*filter);
    }
    Draw draw(seed, -1);
    for (int i = 0; i < length && stops < stop_points(); ++i, ++stops) {
      const int stop = draw.below(length);
      for (int more = draw.below(4); more > 0; --more) {
        Trace of_no_interest;
        advance(*other, 77 + seed, ++other_step, of_no_interest);
      }
      ASSERT_EQ(jml::restore((*image)[stop], *other), Status::ok);
      const int end = std::min(length, stop + 1 + draw.below(most_ahead));
      for (int k = stop + 1; k <= end; ++k) {
        Trace trace;
        advance(*other, seed, k, trace);
        trace.see(*other);
        ASSERT_EQ(trace, shown[k]) << "flight " << seed << ", stopped at " << stop << ", step " << k;
      }
      ASSERT_EQ(jml::save(*again, *other), Status::ok);
      ASSERT_TRUE(*again == (*image)[end])
          << "flight " << seed << ", stopped at " << stop << ", step " << end;
    }
  }
  EXPECT_GT(seen, 0) << "the flights saw nothing of what they are to see";
}
template <typename Make, typename Advance>
void stop_and_go_on(const char* name, const Make& make, const Advance& advance) {
  stop_and_go_on(name, make, advance, [](const auto&) { return 1; });
}

/// Every damaged image is refused, and the filter is then what it was.
template <typename Filter>
void refuse_damages(const Filter& flown, Filter fresh, int count) {
  jml::ImageOf<Filter> intact, bytes, before, after;
  ASSERT_EQ(jml::save(intact, flown), Status::ok);
  ASSERT_EQ(jml::save(before, fresh), Status::ok);
  Draw draw(5, 0);
  const auto size = static_cast<int>(intact.size());
  int changed = 0;
  for (int i = 0; i < count; ++i) {
    bytes = intact;
    std::span<const std::byte> given = bytes;
    const auto at = [&] { return static_cast<std::size_t>(draw.below(size)); };
    const auto word = [&] { return static_cast<std::byte>(draw.next()); };
    switch (i % 7) {
      case 0:  // one to three bits
        for (int bits = 1 + draw.below(3); bits > 0; --bits) bytes[at()] ^= std::byte(1U << draw.below(8));
        break;
      case 1:
        std::swap(bytes[at()], bytes[at()]);
        break;
      case 2:  // cut short
        given = given.first(at());
        break;
      case 3: {  // a burst
        const std::size_t from = at(), length = 1 + static_cast<std::size_t>(draw.below(16));
        for (std::size_t b = from; b < std::min(from + length, bytes.size()); ++b) bytes[b] = word();
        break;
      }
      case 4: {  // a range of zeros or ones
        const std::size_t from = at(), end = from + at();
        const std::byte value = draw.below(2) == 0 ? std::byte{0} : std::byte{0xFF};
        for (std::size_t b = from; b < std::min(end, bytes.size()); ++b) bytes[b] = value;
        break;
      }
      case 5: {  // bytes lost: what follows moves up
        const std::size_t from = at();
        std::copy(bytes.begin() + static_cast<long>(from) + 1, bytes.end(),
                  bytes.begin() + static_cast<long>(from));
        break;
      }
      default:  // eight bytes of nonsense anywhere
        for (int b = 0; b < 8; ++b) bytes[at()] = word();
    }
    const bool whole = given.size() == bytes.size();
    if (whole && bytes == intact) continue;
    ++changed;
    ASSERT_EQ(jml::restore(given, fresh), Status::damaged_image) << i;
  }
  EXPECT_GT(changed, count / 2);
  ASSERT_EQ(jml::save(after, fresh), Status::ok);
  EXPECT_TRUE(after == before);
}

}  // namespace flights
