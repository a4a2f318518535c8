// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A subpaving: at most so many boxes, of which the union holds the truth. In place, without a heap.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <array>
#include <jml/bounded/box.hpp>
#include <limits>
#include <span>

namespace jml::detail {

/// How far two boxes are apart along a state; below zero: by how much they overlap.
template <typename Scalar, int n>
[[nodiscard]] Scalar gap(const Box<Scalar, n>& a, const Box<Scalar, n>& b, int state) {
  return std::max(a.lower(state) - b.upper(state), b.lower(state) - a.upper(state));
}

/// box ∩ with; -1. Where that is empty a state along which they are apart: box is then as it was.
template <typename Scalar, int n>
[[nodiscard]] int meet(Box<Scalar, n>& box, const Box<Scalar, n>& with) {
  for (int i = 0; i < n; ++i) {
    if (!(box.lower(i) <= with.upper(i) && with.lower(i) <= box.upper(i))) return i;
  }
  for (int i = 0; i < n; ++i) {
    box.lower(i) = std::max(box.lower(i), with.lower(i));
    box.upper(i) = std::min(box.upper(i), with.upper(i));
  }
  return -1;
}

/// The smallest box around both.
template <typename Scalar, int n>
[[nodiscard]] Box<Scalar, n> hull(const Box<Scalar, n>& a, const Box<Scalar, n>& b) {
  Box<Scalar, n> out;
  for (int i = 0; i < n; ++i) {
    out.lower(i) = std::min(a.lower(i), b.lower(i));
    out.upper(i) = std::max(a.upper(i), b.upper(i));
  }
  return out;
}

/// The first `count` boxes, and what a rule remembers beside each. None: one box that is kept elsewhere.
template <typename Scalar, int n, int capacity, typename Memory>
class Paving {
 public:
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] std::span<const Box<Scalar, n>> boxes() const {
    return {boxes_.data(), static_cast<std::size_t>(count_)};
  }
  [[nodiscard]] Box<Scalar, n>& box(int k) { return boxes_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] Memory& memory(int k) { return memories_[static_cast<std::size_t>(k)]; }

  /// One box alone.
  void start(const Box<Scalar, n>& first) {
    count_ = 1;
    box(0) = first;
    memory(0) = {};
  }
  /// The last takes the place of box k.
  void drop(int k) {
    --count_;
    if (k == count_) return;
    box(k) = box(count_);
    memory(k) = memory(count_);
  }
  /// Box k in two halves with a common face; the upper one comes last.
  void bisect(int k, int state) {
    const int other = count_++;
    box(other) = box(k);
    memory(other) = memory(k);
    box(k).upper(state) = box(other).lower(state) = point_in(box(k).lower(state), box(k).upper(state));
  }
  /// The smallest box around all of them.
  [[nodiscard]] Box<Scalar, n> hull() const {
    Box<Scalar, n> out = boxes_[0];
    for (const Box<Scalar, n>& part : boxes()) out = detail::hull(out, part);
    return out;
  }

  /// Pairs into their hull, those of the least growth in volume first: until no more than `most` boxes are
  /// left, and beyond that while the hull is no larger than the two together.
  void merge(int most) {
    while (count_ > 1) {
      const Vector<Scalar, n> unit = hull().width();
      Scalar least = std::numeric_limits<Scalar>::infinity();
      int first = 0, second = 1;
      for (int a = 0; a < count_; ++a) {
        for (int b = a + 1; b < count_; ++b) {
          const Scalar both = volume(box(a), unit) + volume(box(b), unit);
          const Scalar growth = volume(detail::hull(box(a), box(b)), unit) - both;
          if (!(growth < least)) continue;
          least = growth;
          first = a;
          second = b;
        }
      }
      if (count_ <= most && !(least <= Scalar(0))) return;
      box(first) = detail::hull(box(first), box(second));
      memory(first) = {};
      drop(second);
    }
  }

  auto each_part(auto&& f) { return f(in_range(count_, 0, capacity), boxes_, memories_); }

 private:
  /// In units of the hull's sides, so that it does not depend on those of the states.
  [[nodiscard]] static Scalar volume(const Box<Scalar, n>& a, const Vector<Scalar, n>& unit) {
    Scalar out = 1;
    for (int i = 0; i < n; ++i) {
      if (unit(i) > Scalar(0)) out *= (a.upper(i) - a.lower(i)) / unit(i);
    }
    return out;
  }

  int count_ = 0;
  std::array<Box<Scalar, n>, static_cast<std::size_t>(capacity)> boxes_;
  std::array<Memory, static_cast<std::size_t>(capacity)> memories_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
