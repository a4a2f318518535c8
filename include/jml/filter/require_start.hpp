// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a user gives to start a filter and to say how long a step is, asked at compile time.
#include <jml/warnings_begin.hpp>
#pragma once

#include <type_traits>

namespace jml::detail {

/// What a filter starts at is of the kind that its method starts at; a method of one's own may know better.
template <typename Method, typename Given, typename Wanted>
consteval bool require_start() {
  constexpr bool box = requires(const Given& given) { given.lower; };
  if constexpr (!requires { typename Method::template RunsOn<double, 1>; }) {
    return true;
  } else if constexpr (requires(const Wanted& wanted) { wanted.P; }) {
    constexpr bool good = !box && !std::is_arithmetic_v<Given> && !requires { Given::RowsAtCompileTime; };
    static_assert(good, "jml: this filter starts at an estimate: give it jml::Estimate{x, P}");
    return good;
  } else if constexpr (requires(const Wanted& wanted) { wanted.lower; }) {
    static_assert(box, "jml: this filter starts at a box: give it jml::Box{lower, upper}");
    return box;
  } else {
    return true;
  }
}

template <typename Scalar, typename Step>
consteval bool require_time() {
  constexpr bool number = std::is_constructible_v<Scalar, const Step&>;
  static_assert(number, "jml: dt is a number of seconds, or jml::at_time(t); the control comes after it");
  return number;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
