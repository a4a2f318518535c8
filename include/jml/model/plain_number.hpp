// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Plain numbers beside the numbers a model also runs on, and the sentence where one is asked of those.
///
/// std::sin(x) finds no way in but by a conversion. Dual and Interval have one to long double, which nothing
/// but such a call asks for (to double it would make `x > 0 ? x : 0.0` ambiguous), and which ends here.
#include <jml/warnings_begin.hpp>
#pragma once

#include <type_traits>

namespace jml::detail {

template <typename N>
concept PlainNumber = std::is_arithmetic_v<N> || std::is_enum_v<N>;

template <typename Base>
consteval bool refuse_plain_function_of_dual() {
  static_assert(!sizeof(Base*),
                "jml: std::sin and its like take plain numbers, and T may be a dual number: write `using "
                "std::sin; sin(x)`, and T for double; where jml has no such function, give the model a "
                "dynamics_jacobian or measurement_jacobian of its own");
  return true;
}
template <typename Base>
consteval bool refuse_plain_function_of_interval() {
  static_assert(!sizeof(Base*),
                "jml: std::sin and its like take plain numbers, and T may be an interval: write `using "
                "std::sin; sin(x)`, and T for double; where jml has no such function, use jml::Linearised");
  return true;
}

/// max and min of a number and a dual number or an interval: the same line has to serve two plain numbers.
template <typename N, typename Plain>
consteval bool require_number_for_max() {
  static_assert(!std::is_integral_v<N> && (!std::is_floating_point_v<Plain> || std::is_same_v<N, Plain>),
                "jml: max(x, 0) and min(x, 0): std::max takes two numbers of one type, and T may be double: "
                "write max(x, T(0))");
  return true;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
