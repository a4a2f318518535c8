// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The members of a plain struct, counted and handed out without being named.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstddef>
#include <jml/attributes.hpp>
#include <optional>
#include <type_traits>
#include <utility>

namespace jml::detail {

template <typename T>
inline constexpr bool is_optional = false;
template <typename T>
inline constexpr bool is_optional<std::optional<T>> = true;

/// Converts to any member; never run, but a constructor that takes it may be compiled.
template <std::size_t>
struct AnyMember {
  template <typename T>
    requires(!is_optional<T>)  // which takes it as it is
  operator T() const {         // NOLINT(google-explicit-constructor)
    JML_UNREACHABLE;
  }
};
/// Converts to a base of T alone.
template <typename T>
struct AnyBase {
  template <typename Base>
    requires(std::is_base_of_v<Base, T> && !std::is_same_v<Base, T>)
  operator Base() const;  // NOLINT(google-explicit-constructor)
};
template <typename T>
inline constexpr bool derives_something = requires { T{AnyBase<T>{}}; };

template <typename T, std::size_t... i>
consteval bool braced(std::index_sequence<i...>) {
  return requires { T{AnyMember<i>{}...}; };
}
inline constexpr int most_members = 16;
/// How many numbers or objects may stand in the braces of a plain struct, the entries of its C arrays one by
/// one; one more than `most_members` where there are more.
template <typename T, int count = most_members + 1>
consteval int count_initialisers() {
  if constexpr (count == 0 || braced<T>(std::make_index_sequence<count>{}))
    return count;
  else
    return count_initialisers<T, count - 1>();
}
/// After `before` of them, so many more in braces of their own, and `after`.
template <typename T, std::size_t... before, std::size_t... inside, std::size_t... after>
consteval bool braced(std::index_sequence<before...>, std::index_sequence<inside...>,
                      std::index_sequence<after...>) {
  return requires { T{AnyMember<before>{}..., {AnyMember<inside>{}...}, AnyMember<after>{}...}; };
}
/// Of how many the member that begins at `at` takes up: the entries of a C array, or one.
template <typename T, int count, int at, int extent = count - at>
consteval int extent_of() {
  constexpr auto before = std::make_index_sequence<at>{};
  if constexpr (extent < 2)
    return 1;
  else if constexpr (braced<T>(before, std::make_index_sequence<extent>{},
                               std::make_index_sequence<count - at - extent>{}) &&
                     !braced<T>(before, std::make_index_sequence<extent>{},
                                std::make_index_sequence<count - at - extent + 1>{}))
    return extent;
  else
    return extent_of<T, count, at, extent - 1>();
}
template <typename T, int count, int at = 0>
consteval int count_members() {
  if constexpr (at >= count)
    return 0;
  else
    return 1 + count_members<T, count, at + extent_of<T, count, at>()>();
}

/// f(member…); what f returns.
template <typename T, typename F>
constexpr auto each_member(T& value, F&& f) {
  constexpr int initialisers = count_initialisers<T>();
  static_assert(
      initialisers <= most_members,
      "jml: a struct with more than sixteen members or entries of a C array: give it a member `auto "
      "each_part(auto&& f) { return f(a, b); }` that names its parts, or take std::array");
  constexpr int count = initialisers <= most_members ? count_members<T, initialisers>() : 0;
  if constexpr (count == 0) {
    return f();
  } else if constexpr (count == 1) {
    auto& [a] = value;
    return f(a);
  } else if constexpr (count == 2) {
    auto& [a, b] = value;
    return f(a, b);
  } else if constexpr (count == 3) {
    auto& [a, b, c] = value;
    return f(a, b, c);
  } else if constexpr (count == 4) {
    auto& [a, b, c, d] = value;
    return f(a, b, c, d);
  } else if constexpr (count == 5) {
    auto& [a, b, c, d, e] = value;
    return f(a, b, c, d, e);
  } else if constexpr (count == 6) {
    auto& [a, b, c, d, e, g] = value;
    return f(a, b, c, d, e, g);
  } else if constexpr (count == 7) {
    auto& [a, b, c, d, e, g, h] = value;
    return f(a, b, c, d, e, g, h);
  } else if constexpr (count == 8) {
    auto& [a, b, c, d, e, g, h, i] = value;
    return f(a, b, c, d, e, g, h, i);
  } else if constexpr (count == 9) {
    auto& [a, b, c, d, e, g, h, i, j] = value;
    return f(a, b, c, d, e, g, h, i, j);
  } else if constexpr (count == 10) {
    auto& [a, b, c, d, e, g, h, i, j, k] = value;
    return f(a, b, c, d, e, g, h, i, j, k);
  } else if constexpr (count == 11) {
    auto& [a, b, c, d, e, g, h, i, j, k, l] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l);
  } else if constexpr (count == 12) {
    auto& [a, b, c, d, e, g, h, i, j, k, l, m] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l, m);
  } else if constexpr (count == 13) {
    auto& [a, b, c, d, e, g, h, i, j, k, l, m, n] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l, m, n);
  } else if constexpr (count == 14) {
    auto& [a, b, c, d, e, g, h, i, j, k, l, m, n, o] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l, m, n, o);
  } else if constexpr (count == 15) {
    auto& [a, b, c, d, e, g, h, i, j, k, l, m, n, o, p] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l, m, n, o, p);
  } else {
    auto& [a, b, c, d, e, g, h, i, j, k, l, m, n, o, p, q] = value;
    return f(a, b, c, d, e, g, h, i, j, k, l, m, n, o, p, q);
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
