// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Plain numbers beside the numbers a model also runs on, and the sentence where one is asked of those.
///
/// std::sin(x) finds no way in but by a conversion. Dual and Interval have one to long double, which nothing
/// but such a call asks for (to double it would make `x > 0 ? x : 0.0` ambiguous), and which ends here.
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

}  // namespace jml::detail
