// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How many bytes the parts of a type take in an image, and a number that tells one arrangement of parts from
/// another; both at compile time.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/image/known.hpp>

namespace jml::detail {

struct Layout {
  std::size_t bytes;
  std::uint64_t shape;
};

/// As of splitmix64, so that neither order nor counts are lost.
[[nodiscard]] constexpr std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
  std::uint64_t z = a * 0x9E3779B97F4A7C15U + b + 0xD1B54A32D192ED03U;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

template <typename Part>
consteval Layout layout_of();

[[nodiscard]] consteval Layout joined(std::uint64_t kind) { return {0, kind}; }
template <typename... More>
[[nodiscard]] consteval Layout joined(std::uint64_t kind, const Layout& first, const More&... more) {
  const Layout rest = joined(mixed(kind, first.shape), more...);
  return {first.bytes + rest.bytes, rest.shape};
}
[[nodiscard]] consteval Layout repeated(std::size_t count, const Layout& one) {
  return {count * one.bytes, mixed(mixed(101, one.shape), count)};
}

/// What a class consists of. A compile-time error that begins here is about T.
template <typename T, typename... Part>
consteval Layout layout_of_class(PartList<Part...>) {
  return joined(102, layout_of<Part>()...);
}
template <typename T>
consteval Layout layout_of_class() {
  constexpr bool names_parts = !std::is_void_v<PartsIn<T>>;
  static_assert(names_parts,
                "jml: each_part(f) returns what f returns: `auto each_part(auto&& f) { return f(a, b); }`");
  if constexpr (names_parts) return layout_of_class<T>(PartsIn<T>{});
  return {};
}

template <typename T>
struct LayoutOf {
  static consteval Layout get() {
    if constexpr (PartNumber<T>) {
      require_number<T>();
      constexpr std::uint64_t kind = std::is_same_v<T, bool>       ? 1
                                     : std::is_enum_v<T>           ? 2
                                     : std::is_floating_point_v<T> ? 3
                                     : std::is_signed_v<T>         ? 4
                                                                   : 5;
      return {bytes_of_number<T>, mixed(kind, bytes_of_number<T>)};
    } else if constexpr (FixedMatrix<T>) {
      const Layout entries = repeated(std::size_t(T::SizeAtCompileTime), layout_of<typename T::Scalar>());
      return {entries.bytes, mixed(entries.shape, std::uint64_t(T::RowsAtCompileTime))};
    } else if constexpr (std::is_bounded_array_v<T>) {
      return repeated(std::extent_v<T>, layout_of<std::remove_extent_t<T>>());
    } else if constexpr (is_std_array<T>) {
      return repeated(std::tuple_size_v<T>, layout_of<typename T::value_type>());
    } else {
      return layout_of_class<T>();
    }
  }
};
template <typename... T>
struct LayoutOf<std::tuple<T...>> {
  static consteval Layout get() { return joined(103, layout_of<T>()...); }
};
template <typename A, typename B>
struct LayoutOf<std::pair<A, B>> : LayoutOf<std::tuple<A, B>> {};
template <typename T>
struct LayoutOf<std::optional<T>> {
  static consteval Layout get() { return joined(104, layout_of<bool>(), layout_of<T>()); }
};
template <typename... T>
struct LayoutOf<std::variant<T...>> {
  static_assert(sizeof...(T) < 256 && (std::is_default_constructible_v<T> && ...),
                "jml: to restore a std::variant each of its types needs a default constructor");
  static consteval Layout get() {
    std::size_t most = 0;
    ((most = std::max(most, layout_of<T>().bytes)), ...);
    return {1 + most, joined(105, layout_of<T>()...).shape};
  }
};
template <typename I>
struct LayoutOf<RangedPart<I>> : LayoutOf<I> {};
template <typename There, typename Part>
struct LayoutOf<PartIf<There, Part>> {
  static consteval Layout get() { return layout_of<Part>(); }
};
template <int count, typename Get>
struct LayoutOf<PartSeries<count, Get>> {
  static consteval Layout get() {
    return repeated(std::size_t(count), layout_of<std::invoke_result_t<Get&, int>>());
  }
};

template <typename Part>
consteval Layout layout_of() {
  return LayoutOf<std::remove_reference_t<Part>>::get();
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
