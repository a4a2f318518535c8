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
#include <jml/bounded/packed_row.hpp>
#include <limits>

namespace jml::detail {

template <typename Scalar, int n, int columns>
class Zonotope {
  using State = Vector<Scalar, n>;
  using Row = Vector<Scalar, columns>;

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
    kernel::set_zero(rows_);
    reach_ = axes_ + rounding * axes_;
  }

  [[nodiscard]] const State& centre() const { return centre_; }
  /// Half the width of the smallest box around it.
  [[nodiscard]] const State& reach() const { return reach_; }

  /// x ↦ A (x - c) + to + inputs s ± error: its new centre is `to`.
  template <int inputs>
  void map(const Matrix<Scalar, n, n>& A, const State& to, const Matrix<Scalar, n, inputs>& input,
           const State& error) {
    static_assert(inputs <= 8 * (n + columns),
                  "jml: more disturbances than the slack for rounding is made for");
    const State size = kernel::absolute(A) * reach_ + kernel::row_sums(input);
    Matrix<Scalar, n, n + inputs> more;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) more(i, j) = A(i, j) * axes_(j);
    }
    kernel::set_block(more, 0, n, input);
    axes_ = error + rounding * (size + kernel::absolute(to));
    centre_ = to;
    // T becomes A T, without its axes.
    State apart = kernel::zeros<State>();
    keep_largest(
        more, n + inputs, apart, State(size + axes_), [&](int, const auto& before, auto& after) JML_INLINE {
          kernel::repeat<n>([&](int i) JML_INLINE {
            after[i] = before[0] * A(i, 0);
            kernel::repeat<n - 1>([&](int k) JML_INLINE { after[i] += before[k + 1] * A(i, k + 1); });
          });
        });
  }

  /// Intersects with |offset - h (x - c)| ≤ width; returns by how much it misses, 0 where it does not.
  [[nodiscard]] Scalar intersect(const Vector<Scalar, n>& h, Scalar offset, Scalar width) {
    const State along_axes = kernel::by_entry(axes_, h);
    Row along = kernel::zeros<Row>();
    for (int i = 0; i < n; ++i) {
      if (h(i) != Scalar(0)) add_scaled_row<columns>(along.data(), h(i), row(i));
    }
    Scalar size = absolute_sum<columns>(along.data()),
           weight = width * width + product_sum<columns>(along.data(), along.data());
    for (int i = 0; i < n; ++i) {
      size += std::abs(along_axes(i));
      weight += along_axes(i) * along_axes(i);
    }
    const Scalar slack = rounding * (size + std::abs(offset) + width);
    if (!(std::abs(offset) <= size + width + slack)) return std::abs(offset) - size - width;
    if (std::abs(offset) + size <= width) return 0;  // all of it lies in the strip
    if (!(weight > Scalar(0))) return 0;
    State gain;
    for (int i = 0; i < n; ++i)
      gain(i) = (product_sum<columns>(row(i), along.data()) + axes_(i) * along_axes(i)) / weight;

    Matrix<Scalar, n, n + 1> more;
    State apart = axes_;  // an axis that the strip does not see
    int count = 0;
    for (int j = 0; j < n; ++j) {
      if (h(j) == Scalar(0)) continue;
      for (int i = 0; i < n; ++i) more(i, count) = -(gain(i) * along_axes(j));
      more(j, count++) += axes_(j);
      apart(j) = 0;
    }
    for (int i = 0; i < n; ++i) more(i, count) = gain(i) * width;
    const State before = reach_;
    centre_ += gain * offset;
    axes_ = rounding *
            (before + kernel::absolute(centre_) + kernel::absolute(gain) * (size + std::abs(offset) + width));
    keep_largest(more, count + 1, apart, before, [&](int j, const auto& old, auto& after) JML_INLINE {
      const auto there = load<std::remove_cvref_t<decltype(old[0])>>(along.data(), j);
      kernel::repeat<n>([&](int i) JML_INLINE { after[i] = old[i] - there * gain(i); });
    });
    return 0;
  }

  auto each_part(auto&& f) { return f(centre_, axes_, reach_, rows_); }

 private:
  [[nodiscard]] Scalar* row(int i) { return rows_.data() + i * columns; }

  /// In one pass over the rows of T. Column by column, with a search for each one that goes, the zonotope
  /// took 82 of the 105 thousand instructions of a step with n = 6 and p = 3; so it takes 30.
  ///
  /// The columns become change(column), and there are `count` more, and `apart`, one along each axis. As many
  /// as that become a box, in the axes (Girard 2005): those which a box of their own enlarges least. `unit`:
  /// a length for each state.
  template <int most, typename Change>
  void keep_largest(const Matrix<Scalar, n, most>& more, int count, State& apart, const State& unit,
                    const Change& change) {
    State per_unit;
    for (int i = 0; i < n; ++i) per_unit(i) = unit(i) > Scalar(0) ? Scalar(1) / unit(i) : Scalar(0);
    Row loss;
    // A column and its box reach as far: the sum of all is known here.
    Scalar reach[n][kernel::lanes<Scalar, columns>(columns)] = {};
    in_packets<Scalar, columns>([&]<typename P>(int j) JML_INLINE {
      P old[n], column[n], sum{}, largest{};
      kernel::repeat<n>([&](int i) JML_INLINE { old[i] = load<P>(row(i), j); });
      change(j, old, column);
      kernel::repeat<n>([&](int i) JML_INLINE {
        const P size = lanes_absolute<Scalar>(column[i]), part = size * per_unit(i);
        sum += part;
        largest = lanes_larger(part, largest);
        store(reach[i], 0, P(load<P>(reach[i], 0) + size));
        store(row(i), j, column[i]);
      });
      store(loss.data(), j, P(sum - largest));
    });

    // The least so far: first those that are more, then whatever is less than the largest of them.
    Scalar least[most];
    int which[most], last = 0;
    for (int k = 0; k < count; ++k) {
      Scalar sum = 0, largest = 0;
      for (int i = 0; i < n; ++i) {
        const Scalar size = std::abs(more(i, k)), part = size * per_unit(i);
        reach[i][0] += size;
        sum += part;
        largest = part > largest ? part : largest;
      }
      // At no loss those that are there go first: an axis that is kept apart has more to give later.
      least[k] = std::max(sum - largest, std::numeric_limits<Scalar>::min());
      which[k] = columns + k;
      if (least[k] > least[last]) last = k;
    }
    bool stays[most] = {};
    for (int j = 0; j < columns; ++j) {
      if (!(loss(j) < least[last])) continue;
      if (which[last] >= columns) stays[which[last] - columns] = true;
      least[last] = loss(j);
      which[last] = j;
      for (int k = 0; k < count; ++k) last = least[k] > least[last] ? k : last;
    }
    for (int i = 0; i < n; ++i) reach_(i) = apart(i) + axes_(i);
    int next = 0;
    for (int k = 0; k < count; ++k) {
      const int j = which[k];
      if (j >= columns) {
        for (int i = 0; i < n; ++i) axes_(i) += std::abs(more(i, j - columns));
        continue;
      }
      while (!stays[next]) ++next;
      for (int i = 0; i < n; ++i) {
        axes_(i) += std::abs(row(i)[j]);
        row(i)[j] = more(i, next);
      }
      ++next;
    }
    if (least[last] == Scalar(0)) fill(apart);
    axes_ += apart;
    axes_ += rounding * axes_;
    for (int i = 0; i < n; ++i) {
      for (const Scalar lane : reach[i]) reach_(i) += lane;
    }
    reach_ += Scalar(2) * rounding * reach_;
  }
  /// Columns of zeros become those that are apart.
  JML_RARE void fill(State& apart) {
    for (int i = 0, j = 0; i < n; ++i) {
      if (apart(i) == Scalar(0)) continue;
      const auto used = [&] {
        bool any = false;
        for (int k = 0; k < n; ++k) any |= row(k)[j] != Scalar(0);
        return any;
      };
      while (j < columns && used()) ++j;
      if (j == columns) return;
      row(i)[j] = apart(i);
      apart(i) = 0;
    }
  }

  State centre_ = kernel::zeros<State>(), axes_ = kernel::zeros<State>(), reach_ = kernel::zeros<State>();
  // Tᵀ: what is done to all columns is done to its columns, in packets.
  Matrix<Scalar, columns, n> rows_ = kernel::zeros<Matrix<Scalar, columns, n>>();
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
