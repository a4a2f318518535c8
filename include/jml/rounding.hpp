// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What rounding may have made of a covariance in its worst direction, at the price of n³/6 products.
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

/// P (lower triangle read) against the sizes, squared, of what its rows came from.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Pivots<Scalar> pivots_of(const Matrix<Scalar, n, n>& P,
                                                         const Vector<Scalar, n>& sizes) {
  [[maybe_unused]] constexpr Scalar most = std::numeric_limits<Scalar>::max();
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
  } else {
    Matrix<Scalar, n, n> L, scaled;  // L D, and L
    Scalar sum = 0, lowest = most;
    Vector<Scalar, n> from;  // what pivot j came from: sizes_j + Σ L_jk² from_k
    kernel::assign(from, sizes);
    const auto column = [&](int j) JML_INLINE {
      const Scalar pivot = L(j, j), inverse = Scalar(1) / pivot;
      const Scalar loss = from(j) * inverse;
      lowest = pivot < lowest ? pivot : lowest;
      out.loss = loss > out.loss ? loss : out.loss;
      sum += P(j, j);
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
  }
  return out;
}

/// The same where a variance may be zero: then it counts for nothing, if its size was zero too. By value, so
/// that what is asked about need not live in memory.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Pivots<Scalar> pivots_with_zeros(Matrix<Scalar, n, n> P, Vector<Scalar, n> sizes) {
  for (int i = 0; i < n; ++i) {
    bool zero = sizes(i) == Scalar(0);
    for (int j = 0; j < n; ++j) zero = zero && (i > j ? P(i, j) : P(j, i)) == Scalar(0);
    if (zero) P(i, i) = sizes(i) = Scalar(1);
  }
  return pivots_of(P, sizes);
}

/// The most that rounding may make of P in a step of the plain form, in its worst direction, by the sizes of
/// what it came from. A tenth of what x may be off by, in deviations: the gain is as wrong as P is.
template <typename Scalar>
inline constexpr Scalar plain_error = std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(1e-7);
/// The same of an iterated rule.
template <typename Scalar>
inline constexpr Scalar iterated_error = std::is_same_v<Scalar, float> ? Scalar(2.5e-3) : Scalar(1.3e-6);
/// Of an innovation y - H x: how much larger its terms may be than √R, squared, for ε of them not to matter:
/// 1e-7 of a standard deviation, in float 1e-3.
template <typename Scalar>
inline constexpr Scalar finest_innovation = std::is_same_v<Scalar, float> ? Scalar(1e8) : Scalar(2e17);
/// y² + Σ (H x)² of each row.
template <typename Scalar, int n, int p>
[[nodiscard]] JML_INLINE inline Vector<Scalar, p> innovation_sizes(const Matrix<Scalar, p, n>& H,
                                                                   const Vector<Scalar, n>& x,
                                                                   const Vector<Scalar, p>& y) {
  Vector<Scalar, p> out;
  for (int i = 0; i < p; ++i) {
    Scalar terms = y(i) * y(i);
    for (int j = 0; j < n; ++j) terms += (H(i, j) * x(j)) * (H(i, j) * x(j));
    out(i) = terms;
  }
  return out;
}
/// The same as plain_error of a nonsymmetric rule, of the entries of its P.
template <typename Scalar>
inline constexpr Scalar worst_error = std::is_same_v<Scalar, float> ? Scalar(1e-2) : Scalar(1e-3);

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
