// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stop and go on: all that a filter carries as plain bytes, and back.
///
///     jml::ImageOf<decltype(filter)> image;                        // std::array<std::byte, …>
///     const auto saved = jml::save(image, filter);
///     const auto status = jml::restore(image, filter);             // in another run, or another processor
///
/// A restored filter goes on bit for bit as the saved one would have. An image holds what can change once a
/// filter is made: the belief (with what it keeps of a window, boxes and low digits), time, the control of
/// the last step, gate, status, and the options of the method. The dynamics and what else the constructor was
/// given for good (an integrator's options) are the program's own, and have to be the same. Sensor objects
/// that a window remembers are saved by their parts, as image/parts.hpp says. Recorders (Batch, Smoother) are
/// not saved.
///
/// Bytes: "jmlsave", format version, fingerprint, length of what follows, the parts in their order, CRC-64 of
/// it all. Numbers are little-endian on every machine, so an image of a Cortex-M7 is read on the desk. The
/// fingerprint is of sizes, scalars and order of all parts, and of the names of method and model without
/// their namespaces.
///
/// CVODE keeps a history of its own, which no image holds: a restored filter starts it afresh. Restored from
/// its own image where it is saved, a flying filter does so too, and both go on bit by bit alike.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/image/frame.hpp>
#include <jml/image/walk.hpp>

namespace jml {

/// Bytes of an image of these objects: a filter, and plain structs or classes with each_part() beside it.
template <typename... Object>
[[nodiscard]] consteval std::size_t saved_size() {
  return detail::frame_bytes + detail::layout_of_all<std::remove_cvref_t<Object>...>().bytes;
}
/// The same, of objects at hand.
template <typename... Object>
[[nodiscard]] consteval std::size_t saved_size(const Object&...) {
  return saved_size<Object...>();
}
/// A place for an image of such objects.
template <typename... Object>
using ImageOf = std::array<std::byte, saved_size<Object...>()>;

/// All objects into one image, at the beginning of `image`. memory_full, and nothing is written: it is
/// shorter than saved_size().
template <typename... Object>
[[nodiscard]] Status save(std::span<std::byte> image, const Object&... objects) {
  static_assert(sizeof...(Object) > 0, "jml: save(image, filter): there is nothing to save");
  constexpr detail::Layout layout = detail::layout_of_all<Object...>();
  if (image.size() < detail::frame_bytes + layout.bytes) return Status::memory_full;
  detail::begin_image(image, layout);
  detail::ImageWriter writer{image.data() + detail::head_bytes};
  // A visit that only reads, through the one way that an object names its parts by.
  (detail::go_through(writer, const_cast<Object&>(objects)), ...);
  detail::end_image(image.first(detail::frame_bytes + layout.bytes));
  return Status::ok;
}

/// From an image of objects of the same types in the same order; what follows it in `image` is not read.
/// Nothing is touched on refusal:
///   damaged_image   no image, or cut short; its checksum does not match; or it says what none of these
///                   objects can be (a bool of 2, an index beyond its end)
///   foreign_image   an intact one, of other objects or of another format version
template <typename... Object>
[[nodiscard]] Status restore(std::span<const std::byte> image, Object&... objects) {
  static_assert(sizeof...(Object) > 0, "jml: restore(image, filter): there is nothing to restore");
  static_assert((!std::is_const_v<Object> && ...),
                "jml: restore(image, filter): what is restored is not const");
  constexpr detail::Layout layout = detail::layout_of_all<Object...>();
  if (const Status status = detail::check_image(image, layout); status != Status::ok) return status;
  detail::ImageReader reader{image.data() + detail::head_bytes};
  (detail::go_through(reader, objects), ...);
  if (!reader.good) return Status::damaged_image;
  reader = {image.data() + detail::head_bytes};
  reader.writes = true;
  (detail::go_through(reader, objects), ...);
  return Status::ok;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
