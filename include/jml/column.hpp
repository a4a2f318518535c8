// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A column of numbers in registers: packets of the widest kind that fits, and what is left over in smaller
/// ones.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstring>
#include <jml/written_out.hpp>

namespace jml::kernel {

#if !JML_GNU
inline constexpr int packet_bytes = 0;  // no vector extensions
#elif defined(__AVX__)
inline constexpr int packet_bytes = 32;
#elif defined(__SSE2__) || defined(__aarch64__)
inline constexpr int packet_bytes = 16;
#else
inline constexpr int packet_bytes = 0;  // no vector registers
#endif

/// Lanes of the widest packet that fits into what is left of a column; 1 means plain scalars. Columns of up
/// to three stay scalars: the compiler then keeps whole matrices in registers.
template <typename Scalar, int rows>
constexpr int lanes(int left) {
  int width = rows < 4 ? 1 : packet_bytes / static_cast<int>(sizeof(Scalar));
  while (width > left) width /= 2;
  return width < 1 ? 1 : width;
}

template <typename Scalar, int width>
struct Packet {
#if JML_GNU
  typedef Scalar type __attribute__((vector_size(width * sizeof(Scalar))));
#else
  using type = Scalar;
#endif
};
template <typename Scalar>
struct Packet<Scalar, 1> {
  using type = Scalar;
};

/// A column of n numbers in registers: as many packets of the widest kind as fit, then smaller ones. They do
/// not overlap: a load that spans two earlier stores would wait for both.
template <typename Scalar, int n, int width = lanes<Scalar, n>(n)>
struct Column {
  using P = typename Packet<Scalar, width>::type;
  static constexpr int count = n / width, left = n % width;
  P part[count];
  Column<Scalar, left, lanes<Scalar, 4>(left > 0 ? left : 1)> rest;

  JML_INLINE void clear() {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] = P{}; });
    rest.clear();
  }
  JML_INLINE void load(const Scalar* from) {
    repeat<count, 9>([&](int c) JML_INLINE { std::memcpy(&part[c], from + c * width, sizeof(P)); });
    rest.load(from + count * width);
  }
  JML_INLINE void store(Scalar* to) const {
    repeat<count, 9>([&](int c) JML_INLINE { std::memcpy(to + c * width, &part[c], sizeof(P)); });
    rest.store(to + count * width);
  }
  [[nodiscard]] JML_INLINE Scalar at(int i) const {
    if (i >= count * width) return rest.at(i - count * width);
    if constexpr (width == 1)
      return part[i];
    else
      return part[i / width][i % width];
  }
  /// += a factor.
  JML_INLINE void add(const Column& a, Scalar factor) {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] += a.part[c] * factor; });
    rest.add(a.rest, factor);
  }
  /// += a factors, by entry.
  JML_INLINE void add(const Column& a, const Column& factors) {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] += a.part[c] * factors.part[c]; });
    rest.add(a.rest, factors.rest);
  }
  JML_INLINE void subtract(const Column& a, Scalar factor) {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] -= a.part[c] * factor; });
    rest.subtract(a.rest, factor);
  }
  JML_INLINE void multiply(const Column& a) {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] *= a.part[c]; });
    rest.multiply(a.rest);
  }
  JML_INLINE void scale(Scalar factor) {
    repeat<count, 9>([&](int c) JML_INLINE { part[c] *= factor; });
    rest.scale(factor);
  }
  [[nodiscard]] JML_INLINE Scalar dot(const Column& b) const {
    P sums = part[0] * b.part[0];
    JML_WRITTEN_OUT for (int c = 1; c < count; ++c) sums += part[c] * b.part[c];
    if constexpr (width == 1) {
      return sums;
    } else {
      Scalar sum = rest.dot(b.rest);
      JML_WRITTEN_OUT for (int l = 0; l < width; ++l) sum += sums[l];
      return sum;
    }
  }
};
template <typename Scalar, int width>
struct Column<Scalar, 0, width> {
  JML_INLINE void clear() {}
  JML_INLINE void load(const Scalar*) {}
  JML_INLINE void store(Scalar*) const {}
  [[nodiscard]] JML_INLINE Scalar at(int) const { return Scalar(0); }
  JML_INLINE void add(const Column&, Scalar) {}
  JML_INLINE void add(const Column&, const Column&) {}
  JML_INLINE void subtract(const Column&, Scalar) {}
  JML_INLINE void scale(Scalar) {}
  JML_INLINE void multiply(const Column&) {}
  [[nodiscard]] JML_INLINE Scalar dot(const Column&) const { return Scalar(0); }
};

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
