// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A number for the name of a type, the same of GCC and Clang, on the host and on the target.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/image/layout.hpp>
#include <string_view>

namespace jml::detail {

/// As the compiler spells T.
template <typename T>
consteval std::string_view spelling() {
#if defined(_MSC_VER) && !defined(__clang__)
  std::string_view all = __FUNCSIG__;  // "… jml::detail::spelling<struct a::B<c,d> >(void)"
  all = all.substr(all.find("spelling<") + 9);
  all = all.substr(0, all.rfind(">(void)"));
  return all.back() == ' ' ? all.substr(0, all.size() - 1) : all;
#else
  const std::string_view all = __PRETTY_FUNCTION__;  // "… [with T = a::B<c, d>; …" or "… [T = a::B<c, d>]"
  const std::string_view rest = all.substr(all.find("T = ") + 4);
  const std::size_t aliases = rest.find("; std::string_view = ");
  return rest.substr(0, aliases < rest.size() ? aliases : rest.size() - 1);
#endif
}
/// The last word of a spelling.
[[nodiscard]] consteval std::uint64_t last_word(std::string_view text) {
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  while (!text.empty() && !letter(text.back())) text.remove_suffix(1);
  std::uint64_t word = 106;
  for (; !text.empty() && letter(text.back()); text.remove_suffix(1))
    word = mixed(word, std::uint64_t(text.back()));
  return word;
}

/// The name of a type without what surrounds it, and of the arguments of a template likewise; these one by
/// one, as compilers spell them out or leave them away when they are the default ones.
template <typename T>
consteval std::uint64_t name_of();
template <auto...>
struct Values {};
template <typename T>
struct NameOfArguments {
  static constexpr std::uint64_t value = 0;
};
template <template <typename...> class W, typename... A>
struct NameOfArguments<W<A...>> {
  static consteval std::uint64_t get() {
    std::uint64_t all = 107;
    ((all = mixed(all, name_of<A>())), ...);
    return all;
  }
  static constexpr std::uint64_t value = get();
};
template <template <auto...> class W, auto... v>
  requires(sizeof...(v) > 0)
struct NameOfArguments<W<v...>> {
  static consteval std::uint64_t get() {
    std::uint64_t all = 108;
    ((all = mixed(all, value_of<v>())), ...);
    return all;
  }
  template <auto number>
  static consteval std::uint64_t value_of() {
    if constexpr (requires { static_cast<std::int64_t>(number); })
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(number));
    return 0;
  }
  static constexpr std::uint64_t value = get();
};
template <template <typename, auto> class W, typename A, auto v>
struct NameOfArguments<W<A, v>> {
  static constexpr std::uint64_t value = mixed(name_of<A>(), NameOfArguments<Values<v>>::value);
};
template <template <auto, auto, typename> class W, auto v, auto w, typename A>
struct NameOfArguments<W<v, w, A>> {
  static constexpr std::uint64_t value = mixed(name_of<A>(), NameOfArguments<Values<v, w>>::value);
};
template <typename T>
consteval std::uint64_t name_of() {
  if constexpr (PartNumber<T> && !std::is_enum_v<T>) {
    return layout_of<T>().shape;
  } else {
    constexpr std::string_view text = spelling<T>();
    const std::uint64_t template_name = last_word(text.substr(0, text.find('<')));
    const std::uint64_t inside = text.back() == '>' ? 0 : last_word(text);  // W<A>::Inside
    return mixed(mixed(template_name, inside), NameOfArguments<T>::value);
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
