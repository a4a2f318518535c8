// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A long row of numbers, handled in packets: the generators of a zonotope.
///
/// The compiler may not reorder a sum, so it leaves one number after the other; here a sum is one per lane.
#include <jml/warnings_begin.hpp>
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <jml/kernels.hpp>

namespace jml::detail {

/// use.operator()<P>(j) for packets P of the numbers j, j + 1, ... of `count`: the widest first.
template <typename Scalar, int count, int first = 0, typename Use>
JML_INLINE inline void in_packets(Use&& use) {
  if constexpr (first < count) {
    constexpr int width = kernel::lanes<Scalar, count>(count - first);
    constexpr int end = count - (count - first) % width;
    using P = typename kernel::Packet<Scalar, width>::type;
    kernel::repeat<(end - first) / width>([&](int k)
                                              JML_INLINE { use.template operator()<P>(first + k * width); });
    in_packets<Scalar, count, end>(use);
  }
}

template <typename P, typename Scalar>
[[nodiscard]] JML_INLINE inline P load(const Scalar* row, int j) {
  P packet;
  std::memcpy(&packet, row + j, sizeof(P));
  return packet;
}
template <typename P, typename Scalar>
JML_INLINE inline void store(Scalar* row, int j, const P& packet) {
  std::memcpy(row + j, &packet, sizeof(P));
}
/// |a|, lane by lane.
template <typename Scalar, typename P>
[[nodiscard]] JML_INLINE inline P lanes_absolute(const P& a) {
  if constexpr (std::same_as<P, Scalar>) {
    return std::abs(a);
  } else {
    using Bits = std::conditional_t<sizeof(Scalar) == 8, std::int64_t, std::int32_t>;
    using Lanes = typename kernel::Packet<Bits, int(sizeof(P) / sizeof(Scalar))>::type;
    return std::bit_cast<P>(std::bit_cast<Lanes>(a) & std::numeric_limits<Bits>::max());
  }
}
template <typename P>
[[nodiscard]] JML_INLINE inline P lanes_larger(const P& a, const P& b) {
  return a > b ? a : b;
}

/// Σ_j term.operator()<P>(j), j < count.
template <typename Scalar, int count, int first = 0, typename Term>
[[nodiscard]] JML_INLINE inline Scalar lanes_sum(const Term& term) {
  if constexpr (first == count) {
    return 0;
  } else {
    constexpr int width = kernel::lanes<Scalar, count>(count - first);
    constexpr int end = count - (count - first) % width;
    using P = typename kernel::Packet<Scalar, width>::type;
    P packet{};
    kernel::repeat<(end - first) / width>(
        [&](int k) JML_INLINE { packet += term.template operator()<P>(first + k * width); });
    Scalar lane[width], sum = 0;
    std::memcpy(lane, &packet, sizeof(P));
    for (int k = 0; k < width; ++k) sum += lane[k];
    return sum + lanes_sum<Scalar, count, end>(term);
  }
}

template <int count, typename Scalar>
[[nodiscard]] JML_INLINE inline Scalar absolute_sum(const Scalar* a) {
  return lanes_sum<Scalar, count>([&]<typename P>(int j)
                                      JML_INLINE { return lanes_absolute<Scalar>(load<P>(a, j)); });
}
template <int count, typename Scalar>
[[nodiscard]] JML_INLINE inline Scalar product_sum(const Scalar* a, const Scalar* b) {
  return lanes_sum<Scalar, count>([&]<typename P>(int j)
                                      JML_INLINE { return P(load<P>(a, j) * load<P>(b, j)); });
}
/// a += factor · b.
template <int count, typename Scalar>
JML_INLINE inline void add_scaled_row(Scalar* a, Scalar factor, const Scalar* b) {
  in_packets<Scalar, count>([&]<typename P>(int j)
                                JML_INLINE { store(a, j, P(load<P>(a, j) + load<P>(b, j) * factor)); });
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
