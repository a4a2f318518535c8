// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The way through the parts of an object, and the two that take it: into bytes, and back.
#include <jml/warnings_begin.hpp>
#pragma once

#include <bit>
#include <jml/image/layout.hpp>
#include <limits>

namespace jml::detail {

template <PartNumber T>
[[nodiscard]] constexpr std::uint64_t encoded(T number) {
  static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);
  if constexpr (std::is_same_v<T, float>)
    return std::bit_cast<std::uint32_t>(number);
  else if constexpr (std::is_same_v<T, double>)
    return std::bit_cast<std::uint64_t>(number);
  else if constexpr (std::is_enum_v<T>)
    return encoded(static_cast<std::underlying_type_t<T>>(number));
  else
    return static_cast<std::uint64_t>(number);
}
/// False where no T of low … high has these bits.
template <PartNumber T>
[[nodiscard]] constexpr bool decode(std::uint64_t bits, T& number, const T& low, const T& high) {
  if constexpr (std::is_same_v<T, float>) {
    number = std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    return true;
  } else if constexpr (std::is_same_v<T, double>) {
    number = std::bit_cast<double>(bits);
    return true;
  } else if constexpr (std::is_same_v<T, bool>) {
    number = bits == 1;
    return bits <= 1;
  } else if constexpr (std::is_enum_v<T>) {
    using Number = std::underlying_type_t<T>;
    Number value{};
    const bool good = decode<Number>(bits, value, Number(0), static_cast<Number>(last_value(T())));
    if (good) number = static_cast<T>(value);
    return good;
  } else {
    number = static_cast<T>(bits);
    constexpr std::uint64_t kept = bytes_of_number<T> == 1 ? 0xFFU : ~std::uint64_t(0);
    return (encoded(number) & kept) == bits && number >= low && number <= high;
  }
}
template <typename T>
inline constexpr T least_number = std::is_enum_v<T> ? T{} : std::numeric_limits<T>::lowest();
template <typename T>
inline constexpr T most_number = std::is_enum_v<T> ? T{} : std::numeric_limits<T>::max();

/// Writes the parts that it is led through.
struct ImageWriter {
  static constexpr bool reads = false;
  std::byte* to;

  template <PartNumber T>
  void number(const T& value, const T& /*low*/, const T& /*high*/) {
    put_bytes(to, encoded(value), bytes_of_number<T>);
    to += bytes_of_number<T>;
  }
  /// What is not there.
  void nothing(std::size_t bytes) {
    std::fill_n(to, bytes, std::byte{0});
    to += bytes;
  }
};

/// Reads them: at first only to see whether they can be what the bytes say, then into the objects.
struct ImageReader {
  static constexpr bool reads = true;
  const std::byte* from;
  bool writes = false, good = true;

  template <PartNumber T>
  void number(T& value, const T& low, const T& high) {
    T found{};
    good = decode(get_bytes(from, bytes_of_number<T>), found, low, high) && good;
    if (writes) value = found;
    from += bytes_of_number<T>;
  }
  void nothing(std::size_t bytes) { from += bytes; }
};

template <typename Visitor, typename Part>
void go_through(Visitor& visitor, Part&& part);

template <typename Visitor, typename T>
void go_through_optional(Visitor& visitor, std::optional<T>& value) {
  bool there = value.has_value();
  if constexpr (Visitor::reads) {
    ImageReader flag = visitor;
    flag.writes = true;
    go_through(flag, there);
    visitor.from = flag.from;
    visitor.good = flag.good;
    if (visitor.writes) {
      if (!there)
        value.reset();
      else if (!value.has_value())
        value.emplace();
    } else if (there) {
      T trial{};
      return go_through(visitor, trial);
    }
  } else {
    go_through(visitor, there);
  }
  if (there)
    go_through(visitor, *value);
  else
    visitor.nothing(layout_of<T>().bytes);
}

template <typename Visitor, typename... T, std::size_t... index>
void go_through_variant(Visitor& visitor, std::variant<T...>& value, std::index_sequence<index...>) {
  constexpr std::size_t bytes = layout_of<std::variant<T...>>().bytes - 1;
  auto which = static_cast<std::uint8_t>(value.index());
  if constexpr (Visitor::reads) {
    const std::size_t end_of_tag = 1;
    if (!decode<std::uint8_t>(get_bytes(visitor.from, 1), which, 0, sizeof...(T) - 1)) {
      visitor.good = false;
      return visitor.nothing(end_of_tag + bytes);
    }
    visitor.from += end_of_tag;
  } else {
    go_through(visitor, which);
  }
  const auto one = [&]<std::size_t i>(std::integral_constant<std::size_t, i>) {
    using Now = std::variant_alternative_t<i, std::variant<T...>>;
    if (which != i) return;
    if constexpr (Visitor::reads) {
      if (!visitor.writes) {
        Now trial{};
        go_through(visitor, trial);
      } else {
        if (value.index() != i) value.template emplace<i>();
        go_through(visitor, *std::get_if<i>(&value));
      }
    } else {
      go_through(visitor, *std::get_if<i>(&value));
    }
    visitor.nothing(bytes - layout_of<Now>().bytes);
  };
  (one(std::integral_constant<std::size_t, index>{}), ...);
}

template <typename Visitor, typename T>
void go_through_class(Visitor& visitor, T& value) {
  each_part_of(value, [&visitor](auto&&... part) { (go_through(visitor, part), ...); });
  if constexpr (Visitor::reads && requires { value.restored(); }) {
    if (visitor.writes) value.restored();
  }
}

/// `part` as parts.hpp says.
template <typename Visitor, typename Part>
void go_through(Visitor& visitor, Part&& part) {
  using T = std::remove_cvref_t<Part>;
  if constexpr (PartNumber<T>) {
    visitor.number(part, least_number<T>, most_number<T>);
  } else if constexpr (FixedMatrix<T>) {
    for (int i = 0; i < int(T::SizeAtCompileTime); ++i) go_through(visitor, part.data()[i]);
  } else if constexpr (std::is_bounded_array_v<T> || is_std_array<T>) {
    for (auto& entry : part) go_through(visitor, entry);
  } else if constexpr (is_tuple<T>) {
    std::apply([&](auto&... entry) { (go_through(visitor, entry), ...); }, part);
  } else if constexpr (is_optional<T>) {
    go_through_optional(visitor, part);
  } else if constexpr (is_variant<T>) {
    go_through_variant(visitor, part, std::make_index_sequence<std::variant_size_v<T>>{});
  } else if constexpr (is_ranged<T>) {
    visitor.number(part.value, part.low, part.high);
  } else if constexpr (is_part_if<T>) {
    bool asked = true;
    if constexpr (Visitor::reads)
      asked = !visitor.writes || part.there();
    else
      asked = part.there();
    if (asked)
      go_through(visitor, part.part);
    else
      visitor.nothing(layout_of<decltype(part.part)>().bytes);
  } else if constexpr (is_series<T>) {
    for (int i = 0; i < series_length<T>; ++i) go_through(visitor, part.get(i));
  } else {
    go_through_class(visitor, part);
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
