// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What surrounds the parts in an image, see filter/save.hpp: "jmlsave" and the version, fingerprint, length;
/// and a checksum after them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/image/crc64.hpp>
#include <jml/image/name.hpp>
#include <jml/status.hpp>

namespace jml::detail {

inline constexpr std::size_t head_bytes = 24, frame_bytes = head_bytes + 8;
inline constexpr std::uint64_t image_magic = 0x0065766173'6C6D6AU;  // "jmlsave", and the version
inline constexpr std::uint64_t image_version = 1;

template <typename... Object>
consteval Layout layout_of_all() {
  const Layout all = joined(107, layout_of<Object>()...);
  std::uint64_t print = all.shape;
  ((print = mixed(print, name_of<Object>())), ...);
  return {all.bytes, print};
}

constexpr void put_bytes(std::byte* to, std::uint64_t number, std::size_t bytes = 8) {
  for (std::size_t i = 0; i < bytes; ++i) to[i] = static_cast<std::byte>(number >> (8 * i));
}
[[nodiscard]] constexpr std::uint64_t get_bytes(const std::byte* from, std::size_t bytes = 8) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < bytes; ++i) number |= std::to_integer<std::uint64_t>(from[i]) << (8 * i);
  return number;
}

inline void begin_image(std::span<std::byte> image, const Layout& layout) {
  put_bytes(image.data(), image_magic | image_version << 56U);
  put_bytes(image.data() + 8, layout.shape);
  put_bytes(image.data() + 16, layout.bytes);
}
inline void end_image(std::span<std::byte> image) {
  put_bytes(image.data() + image.size() - 8, crc64(image.first(image.size() - 8)));
}
[[nodiscard]] inline Status check_image(std::span<const std::byte> image, const Layout& layout) {
  if (image.size() < frame_bytes) return Status::damaged_image;
  const std::uint64_t bytes = get_bytes(image.data() + 16);
  if (bytes > image.size() - frame_bytes) return Status::damaged_image;
  const std::size_t end = head_bytes + static_cast<std::size_t>(bytes);
  if (get_bytes(image.data() + end) != crc64(image.first(end))) return Status::damaged_image;
  const std::uint64_t magic = get_bytes(image.data());
  if (magic << 8U != image_magic << 8U) return Status::damaged_image;
  const bool ours =
      magic >> 56U == image_version && get_bytes(image.data() + 8) == layout.shape && bytes == layout.bytes;
  return ours ? Status::ok : Status::foreign_image;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
