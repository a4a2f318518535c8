// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fixed-size vectors and matrices (Eigen's), and the small functions of them that the library is written in.
#include <jml/warnings_begin.hpp>
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <jml/attributes.hpp>
#include <jml/written_out.hpp>
#include <type_traits>
#include <utility>

#ifdef __FAST_MATH__
#error "jml: -ffast-math removes the checks for NaN; compile without it"
#endif

namespace jml {

/// A matrix of fixed size.
template <typename Scalar, int rows, int cols>
using Matrix = Eigen::Matrix<Scalar, rows, cols>;

/// A column of fixed size.
template <typename Scalar, int rows>
using Vector = Eigen::Matrix<Scalar, rows, 1>;

namespace kernel {

/// to = from, number by number where they are few: a packet would pin them to the stack.
template <typename Scalar, int rows, int cols>
JML_INLINE inline void assign(Matrix<Scalar, rows, cols>& to, const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i) JML_INLINE { to.data()[i] = from.data()[i]; });
  } else {
    to = from;
  }
}

/// to = factor · from, likewise.
template <typename Scalar, int rows, int cols>
JML_INLINE inline void scale(Matrix<Scalar, rows, cols>& to, Scalar factor,
                             const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i) JML_INLINE { to.data()[i] = factor * from.data()[i]; });
  } else {
    for (int i = 0; i < rows * cols; ++i) to.data()[i] = factor * from.data()[i];
  }
}

/// to = start + factor · from, likewise. `to` may be `start`.
template <typename Scalar, int rows, int cols>
JML_INLINE inline void add_scaled(Matrix<Scalar, rows, cols>& to, const Matrix<Scalar, rows, cols>& start,
                                  Scalar factor, const Matrix<Scalar, rows, cols>& from) {
  if constexpr (rows * cols <= 9) {
    repeat<rows * cols, 9>([&](int i)
                               JML_INLINE { to.data()[i] = start.data()[i] + factor * from.data()[i]; });
  } else {
    for (int i = 0; i < rows * cols; ++i) to.data()[i] = start.data()[i] + factor * from.data()[i];
  }
}

/// 0, rows×cols: kernel::zeros<Matrix<double, 2, 2>>().
template <typename M>
[[nodiscard]] JML_INLINE inline M zeros() {
  M out;
  JML_EACH(i, int(M::SizeAtCompileTime), out.data()[i] = typename M::Scalar(0))
  return out;
}

/// Every entry `value`.
template <typename M>
[[nodiscard]] JML_INLINE inline M filled(typename M::Scalar value) {
  M out;
  JML_EACH(i, int(M::SizeAtCompileTime), out.data()[i] = value)
  return out;
}

/// I, n×n.
template <typename M>
[[nodiscard]] JML_INLINE inline M identity() {
  M out = zeros<M>();
  JML_EACH(i, int(M::RowsAtCompileTime), out(i, i) = typename M::Scalar(1))
  return out;
}

template <typename Scalar, int rows, int cols, int options>
JML_INLINE inline void set_zero(Eigen::Matrix<Scalar, rows, cols, options>& a) {
  JML_EACH(i, rows * cols, a.data()[i] = Scalar(0))
}

/// aᵀ.
template <typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline Matrix<Scalar, cols, rows> transposed(const Matrix<Scalar, rows, cols>& a) {
  Matrix<Scalar, cols, rows> out;
  for (int j = 0; j < cols; ++j) {
    JML_EACH(i, rows, out(j, i) = a(i, j))
  }
  return out;
}

/// (a + aᵀ)/2.
template <typename Scalar, int n>
[[nodiscard]] inline Matrix<Scalar, n, n> symmetric_part(const Matrix<Scalar, n, n>& a) {
  Matrix<Scalar, n, n> out;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) out(i, j) = (a(i, j) + a(j, i)) / Scalar(2);
  }
  return out;
}

/// Σ term(i) of `count` terms, i < count: in eight partial sums where there are many, which is eight times
/// shorter to wait for.
template <int count, typename Scalar, typename Term>
[[nodiscard]] JML_INLINE inline Scalar sum_of(const Term& term) {
  if constexpr (count < 16) {
    Scalar sum(0);
    JML_EACH(i, count, sum += term(i))
    return sum;
  } else {
    Scalar part[8] = {};
    for (int i = 0; i + 8 <= count; i += 8) {
      JML_WRITTEN_OUT for (int k = 0; k < 8; ++k) part[k] += term(i + k);
    }
    for (int i = count / 8 * 8; i < count; ++i) part[0] += term(i);
    return ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]));
  }
}

/// aᵀ b of two vectors.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Scalar dot(const Vector<Scalar, n>& a, const Vector<Scalar, n>& b) {
  return sum_of<n, Scalar>([&](int i) JML_INLINE { return a(i) * b(i); });
}

/// Σ a_ij².
template <typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline Scalar squared_norm(const Matrix<Scalar, rows, cols>& a) {
  return sum_of<rows * cols, Scalar>([&](int i) JML_INLINE { return a.data()[i] * a.data()[i]; });
}

/// √Σ a_ij².
template <typename Scalar, int rows, int cols>
[[nodiscard]] inline Scalar norm(const Matrix<Scalar, rows, cols>& a) {
  return std::sqrt(squared_norm(a));
}

/// v/|v|, without over- or underflow on the way; v itself where it is zero.
template <typename Scalar, int n>
[[nodiscard]] inline Vector<Scalar, n> normalised(const Vector<Scalar, n>& v) {
  Scalar most(0);
  for (int i = 0; i < n; ++i) most = std::abs(v(i)) > most ? std::abs(v(i)) : most;
  if (!(most > Scalar(0))) return v;
  const Vector<Scalar, n> shorter = v / most;
  return shorter / norm(shorter);
}

/// max |a_ij|; 0 of an empty matrix, NaN where an entry is not finite.
template <typename Scalar, int rows, int cols>
[[nodiscard]] inline auto largest(const Matrix<Scalar, rows, cols>& a) {
  using std::abs;
  using Real = decltype(abs(Scalar()));
  constexpr int size = rows * cols, lanes = size < 16 ? 1 : 8;
  Real most[lanes] = {}, poison[lanes] = {};  // 0·v is zero where v is finite
  for (int i = 0; i + lanes <= size; i += lanes) {
    for (int k = 0; k < lanes; ++k) {
      const Real entry = abs(a.data()[i + k]);
      most[k] = entry > most[k] ? entry : most[k];
      poison[k] += Real(0) * entry;
    }
  }
  for (int i = size / lanes * lanes; i < size; ++i) {
    const Real entry = abs(a.data()[i]);
    most[0] = entry > most[0] ? entry : most[0];
    poison[0] += Real(0) * entry;
  }
  for (int k = 1; k < lanes; ++k) {
    most[0] = most[k] > most[0] ? most[k] : most[0];
    poison[0] += poison[k];
  }
  return most[0] + poison[0];
}

/// Σ_j |a_ij| of row i, and max over the columns of Σ_i |a_ij|.
template <typename Scalar, int rows, int cols>
[[nodiscard]] inline Vector<Scalar, rows> row_sums(const Matrix<Scalar, rows, cols>& a) {
  Vector<Scalar, rows> out = zeros<Vector<Scalar, rows>>();
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) out(i) += std::abs(a(i, j));
  }
  return out;
}
template <typename Scalar, int rows, int cols>
[[nodiscard]] inline Scalar largest_column_sum(const Matrix<Scalar, rows, cols>& a) {
  return largest(row_sums(transposed(a)));
}

/// |a_ij|, a_ij b_ij and 1/a_i, by entry.
template <typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline Matrix<Scalar, rows, cols> absolute(const Matrix<Scalar, rows, cols>& a) {
  Matrix<Scalar, rows, cols> out;
  JML_EACH(i, rows * cols, out.data()[i] = std::abs(a.data()[i]))
  return out;
}
template <typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline Matrix<Scalar, rows, cols> by_entry(const Matrix<Scalar, rows, cols>& a,
                                                                    const Matrix<Scalar, rows, cols>& b) {
  Matrix<Scalar, rows, cols> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] * b.data()[i])
  return out;
}
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Vector<Scalar, n> inverse_of_entries(const Vector<Scalar, n>& a) {
  Vector<Scalar, n> out;
  JML_EACH(i, n, out(i) = Scalar(1) / a(i))
  return out;
}

/// diag(left) a diag(right).
template <typename Scalar, int rows, int cols>
[[nodiscard]] inline Matrix<Scalar, rows, cols> scaled_by(const Vector<Scalar, rows>& left,
                                                          const Matrix<Scalar, rows, cols>& a,
                                                          const Vector<Scalar, cols>& right) {
  Matrix<Scalar, rows, cols> out;
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) out(i, j) = left(i) * a(i, j) * right(j);
  }
  return out;
}

/// a ← a + number I.
template <typename Scalar, int n>
inline void add_to_diagonal(Matrix<Scalar, n, n>& a, const Scalar& number) {
  for (int i = 0; i < n; ++i) a(i, i) += number;
}

template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Vector<Scalar, n> diagonal(const Matrix<Scalar, n, n>& a) {
  Vector<Scalar, n> out;
  JML_EACH(i, n, out(i) = a(i, i))
  return out;
}

/// Column j of a.
template <typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline Vector<Scalar, rows> column_of(const Matrix<Scalar, rows, cols>& a, int j) {
  Vector<Scalar, rows> out;
  JML_EACH(i, rows, out(i) = a(i, j))
  return out;
}

/// The same numbers in another scalar.
template <typename To, typename Scalar, int rows, int cols>
[[nodiscard]] JML_INLINE inline auto cast(const Matrix<Scalar, rows, cols>& a) {
  if constexpr (std::is_same_v<To, Scalar>) {
    return a;
  } else {
    Matrix<To, rows, cols> out;
    JML_EACH(i, rows * cols, out.data()[i] = static_cast<To>(a.data()[i]))
    return out;
  }
}

template <typename Scalar, int rows, int cols>
inline void set_column(Matrix<Scalar, rows, cols>& a, int j, const Vector<Scalar, rows>& b) {
  for (int i = 0; i < rows; ++i) a(i, j) = b(i);
}
template <typename Scalar, int rows, int cols, int options>
inline void swap_rows(Eigen::Matrix<Scalar, rows, cols, options>& a, int i, int k) {
  for (int j = 0; j < cols; ++j) std::swap(a(i, j), a(k, j));
}
template <typename Scalar, int rows, int cols>
inline void swap_columns(Matrix<Scalar, rows, cols>& a, int j, int k) {
  for (int i = 0; i < rows; ++i) std::swap(a(i, j), a(i, k));
}

/// The block of rows×cols at (i0, j0) as a value, and its place taken by one.
template <int rows, int cols, typename Scalar, int r, int c>
[[nodiscard]] inline Matrix<Scalar, rows, cols> block(const Matrix<Scalar, r, c>& a, int i0, int j0) {
  Matrix<Scalar, rows, cols> out;
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) out(i, j) = a(i0 + i, j0 + j);
  }
  return out;
}
template <typename Scalar, int r, int c, int rows, int cols>
inline void set_block(Matrix<Scalar, r, c>& a, int i0, int j0, const Matrix<Scalar, rows, cols>& b) {
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) a(i0 + i, j0 + j) = b(i, j);
  }
}

}  // namespace kernel

}  // namespace jml
#include <jml/warnings_end.hpp>
