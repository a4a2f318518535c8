// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pivots of a covariance and what rounding has grown by in them.
///
/// P⁺ = N - K S Kᵀ is right to some ε of the terms that were subtracted, N_ii; a direction in which P⁺ is as
/// small as that has no digit left, whatever its diagonal says. The pivots of P⁺ = L D Lᵀ are the variances
/// of each state given those before it; what pivot i came from, N_ii and through L_ik all that those before
/// it came from, over D_i is what rounding has grown by. Negative eigenvalues alone miss two thirds of the
/// lost ones, variances alone all but a few.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/strips.hpp>

namespace jml::detail {

/// The smallest variance whose rounding is that of any other number: below it digits go before the number
/// does.
template <typename Scalar>
inline constexpr Scalar least_variance =
    std::numeric_limits<Scalar>::min() / std::numeric_limits<Scalar>::epsilon();

/// Of the Cholesky pivots of a covariance.
template <typename Scalar>
struct Pivots {
  bool positive = false;  ///< every pivot is, at least least_variance, and all are finite
  Scalar loss = 0;        ///< largest size of what a pivot came from over the pivot
};

/// One after the other: each division waits for the one before.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Pivots<Scalar> pivots_one_by_one(const Matrix<Scalar, n, n>& P,
                                                                 const Vector<Scalar, n>& sizes) {
  [[maybe_unused]] constexpr Scalar most = std::numeric_limits<Scalar>::max();
  Pivots<Scalar> out;
  Matrix<Scalar, n, n> L, scaled;  // L D, and L
  Scalar sum = 0, lowest = most;
  Vector<Scalar, n> from;  // what pivot j came from: sizes_j + Σ L_jk² from_k
  kernel::assign(from, sizes);
  const auto column = [&](int j) JML_INLINE {
    const Scalar pivot = L(j, j), inverse = Scalar(1) / pivot;
    const Scalar loss = from(j) * inverse;
    lowest = pivot < lowest ? pivot : lowest;
    out.loss = loss > out.loss ? loss : out.loss;
    sum += pivot;  // no number where one is none
    return inverse;
  };
  if constexpr (n <= 8) {  // written out, in packets of the whole column
    kernel::Column<Scalar, n> entries[n], one, other, two;
    kernel::repeat<n, 8>([&](int j) JML_INLINE {
      one.load(&P(0, j));
      kernel::repeat<n, 8>([&](int k) JML_INLINE {
        if (k < j) one.subtract(entries[k], scaled(j, k));
      });
      one.store(&L(0, j));
      entries[j] = one;
      one.scale(column(j));
      one.store(&scaled(0, j));
      const Scalar size = from(j);
      two.load(from.data());
      other = one;
      other.multiply(one);
      two.add(other, size);
      two.store(from.data());
    });
  } else {
    for (int j = 0; j < n; ++j) {
      kernel::Strip<Scalar, n>::each_from(j, [&](int i, auto entry) JML_INLINE {
        auto before = entry;
        entry.load(&P(i, j));
        JML_TWICE for (int k = 0; k < j; ++k) {
          before.load(&L(i, k));
          entry.subtract(before, scaled(j, k));
        }
        entry.store(&L(i, j));
      });
      const Scalar inverse = column(j), size = from(j);
      kernel::Strip<Scalar, n>::each_from(j, [&](int i, auto entry) JML_INLINE {
        auto other = entry;
        entry.load(&L(i, j));
        entry.scale(inverse);
        entry.store(&scaled(i, j));
        other.load(&from(i));
        entry.multiply(entry);
        other.add(entry, size);
        other.store(&from(i));
      });
    }
  }
  out.positive = lowest >= least_variance<Scalar> && sum <= most;
  return out;
}

/// Two at a time, 3 to 8 of them, by the determinant of their block: its division and that by the first pivot
/// do not wait for each other, and the numbers that the next two divide by are worked out before their
/// columns. Products of two variances are to be numbers: not positive where they are none, and then
/// pivots_one_by_one() may still find that all is well.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Pivots<Scalar> pivots_in_pairs(const Matrix<Scalar, n, n>& P,
                                                               const Vector<Scalar, n>& sizes) {
  constexpr Scalar most = std::numeric_limits<Scalar>::max();
  Pivots<Scalar> out;
  Matrix<Scalar, n, n> scaled;                                        // L
  kernel::Column<Scalar, n> entries[n], from, one, two, next, other;  // L D; what pivots came from; columns
  Scalar sum = 0, lowest = most;
  const auto note = [&](Scalar pivot, Scalar inverse, Scalar size) JML_INLINE {
    const Scalar loss = size * inverse;
    lowest = pivot < lowest ? pivot : lowest;
    sum += pivot;  // no number where one is none
    out.loss = loss > out.loss ? loss : out.loss;
  };
  const auto keep = [&](int j, kernel::Column<Scalar, n> column, Scalar inverse) JML_INLINE {
    entries[j] = column;
    column.scale(inverse);
    column.store(&scaled(0, j));
    const Scalar size = from.at(j);  // from_i + L_ij² from_j
    column.multiply(column);
    from.add(column, size);
  };
  from.load(sizes.data());
  one.load(&P(0, 0));
  two.load(&P(0, 1));
  Scalar a = one.at(0), b = one.at(1), c = two.at(1);
  kernel::repeat<(n + 1) / 2, 4>([&](int pair) JML_INLINE {
    const int j = 2 * pair;
    const Scalar first = Scalar(1) / a;
    note(a, first, from.at(j));
    if (j + 1 == n) return;
    const Scalar both = a * c - b * b, second = a * (Scalar(1) / both), l = b * first;
    lowest = both < lowest ? both : lowest;
    if (j + 2 == n) return note(both * first, second, from.at(j + 1) + l * l * from.at(j));
    two.subtract(one, l);
    const bool further = j + 3 < n;
    next.load(&P(0, j + 2));
    if (further) other.load(&P(0, j + 3));
    kernel::repeat<n, 8>([&](int k) JML_INLINE {
      if (k < j) next.subtract(entries[k], scaled(j + 2, k));
      if (k < j && further) other.subtract(entries[k], scaled(j + 3, k));
    });
    const auto subtract = [&](int i, kernel::Column<Scalar, n>& column, Scalar& diagonal) JML_INLINE {
      const Scalar u = one.at(i), w = two.at(i), x = u * first, y = w * second;
      diagonal = column.at(i) - u * x - w * y;
      column.subtract(one, x);
      column.subtract(two, y);
    };
    subtract(j + 2, next, a);
    if (further) {
      b = next.at(j + 3);
      subtract(j + 3, other, c);
    }
    keep(j, one, first);
    note(both * first, second, from.at(j + 1));
    keep(j + 1, two, second);
    one = next;
    two = other;
  });
  out.positive = lowest >= least_variance<Scalar> && sum <= most;
  return out;
}

/// P (lower triangle read) against the sizes, squared, of what its rows came from.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Pivots<Scalar> pivots_of(const Matrix<Scalar, n, n>& P,
                                                         const Vector<Scalar, n>& sizes) {
  [[maybe_unused]] constexpr Scalar most = std::numeric_limits<Scalar>::max();
  constexpr bool in_pairs = n <= 8 && kernel::packet_bytes > 0 && std::is_same_v<Scalar, double>;
  Pivots<Scalar> out;
  if constexpr (n == 1) {
    out.positive = P(0, 0) >= least_variance<Scalar> && P(0, 0) <= most;
    out.loss = sizes(0) / P(0, 0);
  } else if constexpr (n == 2) {
    const Scalar a = P(0, 0), c = P(1, 1), b = P(1, 0), first = Scalar(1) / a;
    const Scalar explained = b * (b * first), second = c - explained, inverse = Scalar(1) / second;
    const Scalar loss = sizes(0) * first;  // enters the second pivot through b too
    out.positive = a >= least_variance<Scalar> && second >= least_variance<Scalar>;
    out.loss = loss + (sizes(1) + explained * loss) * inverse;  // no number where one is infinite
  } else if constexpr (in_pairs) {
    out = pivots_in_pairs(P, sizes);
  } else {
    out = pivots_one_by_one(P, sizes);
  }
  return out;
}

/// The same one by one, where a variance may be zero: then it counts for nothing, if its size was zero too.
/// By value, so that what is asked about need not live in memory.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Pivots<Scalar> pivots_with_zeros(Matrix<Scalar, n, n> P, Vector<Scalar, n> sizes) {
  for (int i = 0; i < n; ++i) {
    bool zero = sizes(i) == Scalar(0);
    for (int j = 0; j < n; ++j) zero = zero && (i > j ? P(i, j) : P(j, i)) == Scalar(0);
    if (zero) P(i, i) = sizes(i) = Scalar(1);
  }
  if constexpr (n <= 2)
    return pivots_of(P, sizes);
  else
    return pivots_one_by_one(P, sizes);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
