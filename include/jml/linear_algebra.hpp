// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fixed-size vectors and matrices (Eigen's), and the few questions the estimators ask of them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#ifdef __FAST_MATH__
#error "jml: -ffast-math removes the checks for NaN; compile without it"
#endif

namespace jml {

template <typename Scalar, int rows, int cols>
using Matrix = Eigen::Matrix<Scalar, rows, cols>;

template <typename Scalar, int rows>
using Vector = Eigen::Matrix<Scalar, rows, 1>;

namespace kernel {

/// f(0), f(1), …, f(count - 1): written out up to `limit`, so that the optimiser sees single numbers in
/// registers where it would else see an array in a loop; a loop for more.
template <int count, int limit = 3, typename F>
[[gnu::always_inline]] inline void repeat(const F& f) {
  if constexpr (count <= limit) {
    [&]<int... i>(std::integer_sequence<int, i...>)
        __attribute__((always_inline)) { (f(i), ...); }(std::make_integer_sequence<int, count>{});
  } else {
    for (int i = 0; i < count; ++i) f(i);
  }
}

/// to = from, number by number where they are few: a packet would pin them to the stack.
template <typename Scalar, int rows, int cols>
[[gnu::always_inline]] inline void assign(Matrix<Scalar, rows, cols>& to,
                                          const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i) __attribute__((always_inline)) { to.data()[i] = from.data()[i]; });
  } else {
    to = from;
  }
}

/// to = factor · from, likewise.
template <typename Scalar, int rows, int cols>
[[gnu::always_inline]] inline void scale(Matrix<Scalar, rows, cols>& to, Scalar factor,
                                         const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i)
                               __attribute__((always_inline)) { to.data()[i] = factor * from.data()[i]; });
  } else {
    to = factor * from;
  }
}

/// to = start + factor · from, likewise. `to` may be `start`.
template <typename Scalar, int rows, int cols>
[[gnu::always_inline]] inline void add_scaled(Matrix<Scalar, rows, cols>& to,
                                              const Matrix<Scalar, rows, cols>& start, Scalar factor,
                                              const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i) __attribute__((always_inline)) {
      to.data()[i] = start.data()[i] + factor * from.data()[i];
    });
  } else {
    to = start + factor * from;
  }
}

}  // namespace kernel

/// True if every entry is finite. 0·v is zero exactly where v is finite: four sums and no branch.
template <typename Scalar, int rows, int cols, int options>
[[nodiscard, gnu::always_inline]] inline bool all_finite(
    const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  constexpr int size = rows * cols, fours = size / 4;
  const Scalar* v = a.data();
  Scalar sum[4] = {};
  kernel::repeat<fours, 2>([&](int i) __attribute__((always_inline)) {
    sum[0] += Scalar(0) * v[4 * i];
    sum[1] += Scalar(0) * v[4 * i + 1];
    sum[2] += Scalar(0) * v[4 * i + 2];
    sum[3] += Scalar(0) * v[4 * i + 3];
  });
  kernel::repeat<size - 4 * fours>(
      [&](int i) __attribute__((always_inline)) { sum[i] += Scalar(0) * v[4 * fours + i]; });
  return (sum[0] + sum[1]) + (sum[2] + sum[3]) == Scalar(0);
}

/// True if a(i,j) and a(j,i) agree to rounding, relative to the diagonal's scale of that entry.
template <typename Scalar, int n>
[[nodiscard, gnu::always_inline]] inline bool is_symmetric(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
  for (int j = 0; j < n; ++j) {
    for (int i = j + 1; i < n; ++i) {
      const Scalar scale =
          std::abs(a(i, j)) + std::abs(a(j, i)) + std::sqrt(std::abs(a(i, i))) * std::sqrt(std::abs(a(j, j)));
      if (!(std::abs(a(i, j) - a(j, i)) <= slack * scale)) return false;
    }
  }
  return true;
}

/// True if every entry off the diagonal is zero.
template <typename Scalar, int n>
[[nodiscard, gnu::always_inline]] inline bool is_diagonal(const Matrix<Scalar, n, n>& a) {
  bool zero = true;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) zero &= i == j || a(i, j) == Scalar(0);
  }
  return zero;
}

/// Definiteness asked of a symmetric matrix.
enum class Definite { positive, positive_or_zero };

/// True if the symmetric part of `a` is positive (semi)definite.
///
/// LDLᵀ without pivoting or roots. A pivot counts as zero when it is below the rounding of the diagonal
/// entry that it came from, so the answer does not depend on the units of the components. In the
/// semidefinite case the rest of a zero pivot's column must vanish to rounding too.
template <Definite wanted, typename Scalar, int n>
[[nodiscard]] bool is_definite(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(8 * (n > 0 ? n : 1)) * std::numeric_limits<Scalar>::epsilon();
  Matrix<Scalar, n, n> w = a;
  for (int k = 0; k < n; ++k) {
    const Scalar pivot = w(k, k);
    const Scalar zero = slack * std::abs(a(k, k));
    if constexpr (wanted == Definite::positive) {
      if (!(pivot > zero)) return false;
    } else {
      if (!(pivot >= -zero)) return false;
      if (!(pivot > zero)) {
        for (int i = k + 1; i < n; ++i) {
          const Scalar bound = std::sqrt(slack) * std::sqrt(std::abs(a(k, k))) * std::sqrt(std::abs(a(i, i)));
          if (!(std::abs(w(i, k)) <= bound)) return false;
        }
        continue;
      }
    }
    if (k + 1 == n) break;
    const Scalar inverse = Scalar(1) / pivot;
    for (int j = k + 1; j < n; ++j) {
      const Scalar factor = w(j, k) * inverse;
      for (int i = j; i < n; ++i) w(i, j) -= w(i, k) * factor;
    }
  }
  return true;
}

/// Q is finite, symmetric, positive semidefinite.
template <typename Scalar, int q>
[[nodiscard]] bool is_covariance(const Matrix<Scalar, q, q>& Q) {
  if (is_diagonal(Q)) return (Q.diagonal().array() >= Scalar(0)).all() && all_finite(Q);
  return all_finite(Q) && is_symmetric(Q) && is_definite<Definite::positive_or_zero>(Q);
}

/// R is finite, symmetric, positive definite.
template <typename Scalar, int p>
[[nodiscard, gnu::always_inline]] inline bool is_noise_covariance(const Matrix<Scalar, p, p>& R) {
  if (is_diagonal(R)) return (R.diagonal().array() > Scalar(0)).all() && all_finite(R);
  return all_finite(R) && is_symmetric(R) && is_definite<Definite::positive>(R);
}

}  // namespace jml
