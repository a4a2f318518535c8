// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The parts that an object is made of, for what has to go through all of them: filter/save.hpp.
///
/// Numbers, bool, enums, fixed matrices, std::array, pair, tuple, optional and variant are known, and so are
/// plain structs of up to sixteen of such things. Any other class names its parts in a member,
///
///     auto each_part(auto&& f) { return f(position, jml::in_range(head, 0, size - 1)); }
///
/// (without const, and what f returns is returned), or from outside in a specialisation of jml::PartsOf. What
/// it does not name is not saved. An enum says which of its values is the last, beside its definition:
///
///     constexpr Mode last_value(Mode) { return Mode::failed; }
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <type_traits>
#include <utility>

namespace jml {

/// template <> struct jml::PartsOf<Radio> {
///   static auto each(Radio& radio, auto&& f) { return f(radio.channel, radio.gain); }
/// };
/// Holds for that type alone: a class derived from it has to name its own.
template <typename T>
struct PartsOf {};
/// Of a T that adds nothing to its base.
template <typename T, typename Base>
struct PartsOfBase {
  static auto each(T& value, auto&& f) { return f(static_cast<Base&>(value)); }  ///< the base's parts
};

/// An integer that may be low … high alone, as an index: whatever else an image says is refused.
template <std::integral Integer>
struct RangedPart {
  Integer& value;  ///< to be saved and restored
  Integer low;     ///< least
  Integer high;    ///< greatest
};
/// `value`, restored only from low … high: else damaged_image.
template <std::integral Integer>
[[nodiscard]] constexpr RangedPart<Integer> in_range(Integer& value, std::type_identity_t<Integer> low,
                                                     std::type_identity_t<Integer> high) {
  return {value, low, high};
}

/// A part that counts where there() is true, asked when the parts before it are as they will be. Else it is
/// saved as zeros, and restoring leaves it alone.
template <typename There, typename Part>
struct PartIf {
  There there;  ///< asked before the part
  Part part;    ///< saved and restored where it counts
};
/// `part`, where there() is true.
template <std::predicate There, typename Part>
[[nodiscard]] constexpr PartIf<There, Part> part_if(There there, Part&& part) {
  return {there, std::forward<Part>(part)};
}
/// `flag`: a part before this one.
template <typename Part>
[[nodiscard]] constexpr auto part_if(bool& flag, Part&& part) {
  return part_if([&flag] { return flag; }, std::forward<Part>(part));
}

/// get(0) … get(count - 1), each of them a part of one type; asked when the parts before it are as they will
/// be.
template <int count, typename Get>
struct PartSeries {
  Get get;  ///< by number
};
/// The parts get(0) … get(count - 1).
template <int count, std::invocable<int> Get>
[[nodiscard]] constexpr PartSeries<count, Get> part_series(Get get) {
  return {get};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
