// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The list of sensor types that an estimator with a memory has to make room for.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/concepts.hpp>

namespace jml {

/// `jml::sensors<Radar, Altimeter>`: types, not objects; each measurement brings its own sensor object.
template <typename... S>
struct Sensors {
  static_assert(sizeof...(S) > 0, "jml: name at least one sensor type, jml::sensors<YourSensor>");
  static_assert((detail::require_sensor<S>() && ...));
  static constexpr int count = sizeof...(S);  ///< of types

  /// The place of T in the list; `count` where it is not there.
  template <typename T>
  static constexpr int index_of() {
    int index = 0, found = count;
    ((std::is_same_v<S, T>&& found == count ? found = index++ : index++), ...);
    return found;
  }
};
/// The list, to be handed to a constructor.
template <typename... S>
inline constexpr Sensors<S...> sensors{};

namespace detail {

template <typename List>
inline constexpr bool is_list_of_sensors = false;
template <typename... S>
inline constexpr bool is_list_of_sensors<Sensors<S...>> = true;

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
