// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What jml/image/parts.hpp says it knows, told apart.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <cstdint>
#include <jml/image/aggregate.hpp>
#include <jml/image/parts.hpp>
#include <tuple>
#include <variant>

namespace jml {

namespace detail {

template <typename... Part>
struct PartList {};
/// The types of the parts: T& or one of the above.
struct CollectParts {
  template <typename... Part>
  constexpr PartList<Part...> operator()(Part&&...) const {
    return {};
  }
};

template <typename T>
inline constexpr bool parts_from_outside = requires(T& value) { PartsOf<T>::each(value, CollectParts{}); };
template <typename T>
inline constexpr bool parts_by_member = requires(T& value) { value.each_part(CollectParts{}); };

/// f(part…) of a class; what f returns.
template <typename T, typename F>
constexpr auto each_part_of(T& value, F&& f) {
  if constexpr (parts_from_outside<T>) {
    return PartsOf<T>::each(value, f);
  } else if constexpr (parts_by_member<T>) {
    return value.each_part(f);
  } else if constexpr (std::is_empty_v<T>) {
    return f();
  } else {
    constexpr bool plain = std::is_aggregate_v<T> && !std::is_union_v<T>;
    static_assert(plain,
                  "jml: something to be saved has a part of a type T that jml cannot look into (a class with "
                  "a constructor or private parts, a union, a pointer): give T a member `auto "
                  "each_part(auto&& f) { return f(a, b); }` that names what must be saved of it");
    constexpr bool alone = !derives_something<T>;
    if constexpr (plain) {
      static_assert(alone,
                    "jml: something to be saved has a part of a type T that is derived from another class: "
                    "give T a member `auto each_part(auto&& f) { return f(a, b); }` that names its parts and "
                    "those of its base");
    }
    if constexpr (plain && alone)
      return each_member(value, f);
    else
      return f();
  }
}
template <typename T>
using PartsIn = decltype(each_part_of(std::declval<T&>(), CollectParts{}));

template <typename T>
inline constexpr bool is_ranged = false;
template <typename I>
inline constexpr bool is_ranged<RangedPart<I>> = true;
template <typename T>
inline constexpr bool is_part_if = false;
template <typename There, typename P>
inline constexpr bool is_part_if<PartIf<There, P>> = true;
template <typename T>
inline constexpr int series_length = -1;
template <int count, typename Get>
inline constexpr int series_length<PartSeries<count, Get>> = count;
template <typename T>
inline constexpr bool is_series = series_length<T> >= 0;

template <typename T>
concept FixedMatrix = requires(T& matrix) {
  matrix.data();
  requires int(T::SizeAtCompileTime) >= 0;
  typename T::Scalar;
};
template <typename T>
inline constexpr bool is_std_array = false;
template <typename T, std::size_t n>
inline constexpr bool is_std_array<std::array<T, n>> = true;
template <typename T>
inline constexpr bool is_tuple = false;
template <typename... T>
inline constexpr bool is_tuple<std::tuple<T...>> = true;
template <typename A, typename B>
inline constexpr bool is_tuple<std::pair<A, B>> = true;
template <typename T>
inline constexpr bool is_variant = false;
template <typename... T>
inline constexpr bool is_variant<std::variant<T...>> = true;

/// A number as an image keeps it. Integers of more than one byte are kept in eight, whatever the machine has.
template <typename T>
concept PartNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <PartNumber T>
inline constexpr std::size_t bytes_of_number = std::is_floating_point_v<T> || sizeof(T) == 1 ? sizeof(T) : 8;

template <typename T>
consteval bool require_number() {
  static_assert(!std::is_const_v<T>,
                "jml: something to be saved has a constant part, which cannot be restored: name the parts in "
                "each_part()");
  static_assert(!std::is_floating_point_v<T> || std::is_same_v<T, float> || std::is_same_v<T, double>,
                "jml: a long double is not the same on two machines: a saved part is a float or a double");
  if constexpr (std::is_enum_v<T>) {
    static_assert(
        requires { last_value(T()); },
        "jml: to restore an enum, jml has to know its values: 0 … the last one, said beside it as "
        "`constexpr Mode last_value(Mode) { return Mode::last_of_them; }`");
  }
  return true;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
