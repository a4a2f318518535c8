// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A zonotope {c + T s : |s| ≤ 1}: what a box forgets, which states move together.
///
/// T = [columns, diag(axes)] with a fixed number of columns. The intersection with a strip |ρ - h(x - c)| ≤ β
/// lies for any λ in c + λρ + [(I - λh) T, λβ] s (Alamo, Bravo and Camacho 2005, eq. (9)); λ is the one of
/// least |T|², row by row, as a Kalman gain (Combastel 2015): it does not depend on units. Beyond the
/// bounded-noise dissertation, whose box of an unmeasured state may grow without limit.
/// Everything is rounded outward: what the arithmetic may lose is added to the axes.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/box.hpp>
#include <jml/kernels.hpp>
#include <limits>

namespace jml::detail {

template <typename Scalar, int n, int columns>
class Zonotope {
  using State = Vector<Scalar, n>;

 public:
  /// A sum of k rounded terms is within k/2 ε of their absolute sum; this is four times that, for the terms'
  /// own products and as many inputs as states. Every change leaves the axes at least `rounding` times the
  /// columns' absolute sum above what the truth needs: what Tᵀh loses by cancellation is within that.
  static constexpr Scalar rounding = Scalar(4 * (n + columns) + 16) * std::numeric_limits<Scalar>::epsilon();

  void reset(const Box<Scalar, n>& box) {
    centre_ = box.centre();
    for (int i = 0; i < n; ++i) {
      const Scalar up = box.upper(i) - centre_(i), down = centre_(i) - box.lower(i);
      axes_(i) = up > down ? up : down;
      axes_(i) += rounding * (axes_(i) + std::abs(centre_(i)));
    }
    kernel::set_zero(columns_);
  }

  [[nodiscard]] const State& centre() const { return centre_; }
  /// Half the width of the smallest box around it.
  [[nodiscard]] State reach() const {
    const State sum = kernel::row_sums(columns_) + axes_;
    return sum + rounding * sum;
  }

  /// x ↦ A (x - c) + to + inputs s ± error: its new centre is `to`.
  template <int inputs>
  void map(const Matrix<Scalar, n, n>& A, const State& to, const Matrix<Scalar, n, inputs>& input,
           const State& error) {
    static_assert(inputs <= 8 * (n + columns),
                  "jml: more disturbances than the slack for rounding is made for");
    Matrix<Scalar, n, columns + n + inputs> all;
    const State size = kernel::absolute(A) * reach() + kernel::row_sums(input);
    Matrix<Scalar, n, columns> moved;
    kernel::product(A, columns_, moved);  // A T, without its axes
    kernel::set_block(all, 0, 0, moved);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) all(i, columns + j) = A(i, j) * axes_(j);
    }
    kernel::set_block(all, 0, columns + n, input);
    axes_ = error + rounding * (size + kernel::absolute(to));
    centre_ = to;
    keep_largest(all, State(size + axes_));
  }

  /// Intersects with |offset - h (x - c)| ≤ width; returns by how much it misses, 0 where it does not.
  [[nodiscard]] Scalar intersect(const Vector<Scalar, n>& h, Scalar offset, Scalar width) {
    const State along_axes = kernel::by_entry(axes_, h);
    Scalar size = 0, weight = width * width;
    for (int i = 0; i < n; ++i) {
      size += std::abs(along_axes(i));
      weight += along_axes(i) * along_axes(i);
    }
    Vector<Scalar, columns> along;
    for (int j = 0; j < columns; ++j) {
      along(j) = kernel::dot(kernel::column_of(columns_, j), h);
      size += std::abs(along(j));
      weight += along(j) * along(j);
    }
    const Scalar slack = rounding * (size + std::abs(offset) + width);
    if (!(std::abs(offset) <= size + width + slack)) return std::abs(offset) - size - width;
    if (std::abs(offset) + size <= width) return 0;  // all of it lies in the strip
    if (!(weight > Scalar(0))) return 0;
    const State gain = (columns_ * along + kernel::by_entry(axes_, along_axes)) / weight;
    const State before = reach();

    Matrix<Scalar, n, columns + n + 1> all;
    for (int j = 0; j < columns; ++j) {
      for (int i = 0; i < n; ++i) all(i, j) = columns_(i, j) - gain(i) * along(j);
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) all(i, columns + j) = -(gain(i) * along_axes(j));
      all(j, columns + j) += axes_(j);
    }
    kernel::set_column(all, columns + n, gain * width);
    centre_ += gain * offset;
    axes_ = rounding *
            (before + kernel::absolute(centre_) + kernel::absolute(gain) * (size + std::abs(offset) + width));
    keep_largest(all, before);
    return 0;
  }

  auto each_part(auto&& f) { return f(centre_, axes_, columns_); }

 private:
  /// The columns that a box of their own would enlarge most stay; the rest becomes that box, in the axes
  /// (Girard 2005). `unit`: a length for each state.
  template <int count>
  void keep_largest(const Matrix<Scalar, n, count>& all, const State& unit) {
    Scalar loss[count];
    for (int j = 0; j < count; ++j) {
      Scalar sum = 0, largest = 0;
      for (int i = 0; i < n; ++i) {
        const Scalar part = unit(i) > Scalar(0) ? std::abs(all(i, j)) / unit(i) : Scalar(0);
        sum += part;
        largest = part > largest ? part : largest;
      }
      loss[j] = sum - largest;
    }
    bool boxed[count] = {};
    for (int k = 0; k < count - columns; ++k) {
      int least = -1;
      for (int j = 0; j < count; ++j) {
        if (!boxed[j] && (least < 0 || loss[j] < loss[least])) least = j;
      }
      boxed[least] = true;
      axes_ += kernel::absolute(kernel::column_of(all, least));
    }
    axes_ += rounding * axes_;
    for (int j = 0, to = 0; j < count; ++j) {
      if (!boxed[j]) kernel::set_column(columns_, to++, kernel::column_of(all, j));
    }
  }

  State centre_ = kernel::zeros<State>(), axes_ = kernel::zeros<State>();
  Matrix<Scalar, n, columns> columns_ = kernel::zeros<Matrix<Scalar, n, columns>>();
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
