// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fixed-size vectors and matrices (Eigen's), and their sums and products as values.
///
/// Inside the library a + b of two matrices of one fixed size is a matrix, made by a loop, and not an Eigen
/// expression: each new type of expression costs the compiler as much as a page of plain code, and a filter
/// met a hundred of them. A user's own code, outside namespace jml, keeps Eigen's operators.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <jml/attributes.hpp>
#include <type_traits>
#include <utility>

#ifdef __FAST_MATH__
#error "jml: -ffast-math removes the checks for NaN; compile without it"
#endif

// for (i = 0; i < count; ++i) body, written out by the optimiser where it is short, so that its numbers stay
// in registers. A lambda in its place would cost the compiler a type for each use and size. Undefined below.
#if defined(__GNUC__) && !defined(__clang__)
#define JML_WRITTEN_OUT _Pragma("GCC unroll 9")
#else
#define JML_WRITTEN_OUT
#endif
#define JML_EACH(i, count, body)                            \
  if constexpr ((count) <= 9) {                             \
    JML_WRITTEN_OUT for (int i = 0; i < (count); ++i) body; \
  } else {                                                  \
    for (int i = 0; i < (count); ++i) body;                 \
  }

namespace jml {

template <typename Scalar, int rows, int cols>
using Matrix = Eigen::Matrix<Scalar, rows, cols>;

template <typename Scalar, int rows>
using Vector = Eigen::Matrix<Scalar, rows, 1>;

namespace kernel {

/// f(0), f(1), …, f(count - 1): written out up to `limit`, so that the optimiser sees single numbers in
/// registers where it would else see an array in a loop; a loop for more.
template <int count, int limit = 3, typename F>
JML_INLINE inline void repeat(const F& f) {
  if constexpr (count <= limit) {
    [&]<int... i>(std::integer_sequence<int, i...>)
        JML_INLINE { (f(i), ...); }(std::make_integer_sequence<int, count>{});
  } else {
    for (int i = 0; i < count; ++i) f(i);
  }
}

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

/// A size that is known at compile time.
template <int rows, int cols>
inline constexpr bool fixed = rows != Eigen::Dynamic && cols != Eigen::Dynamic;

/// A number that may scale a matrix of `Scalar`: no expression that could turn into one.
template <typename Number, typename Scalar>
concept NumberFor = std::is_same_v<Number, Scalar> || std::is_arithmetic_v<Number>;

}  // namespace kernel

/// Sums and products as values, for two matrices of one fixed type; a mixture with an Eigen expression stays
/// Eigen's. Not found by argument-dependent lookup: a model's own code keeps Eigen's operators, with dual
/// numbers too. `using namespace jml::operators;` brings them into a file of one's own: less to compile.
namespace operators {

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator+(
    const Eigen::Matrix<Scalar, rows, cols, options>& a,
    const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] + b.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator-(
    const Eigen::Matrix<Scalar, rows, cols, options>& a,
    const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] - b.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator-(
    const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = -a.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator*(
    const Number& factor, const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = Scalar(factor) * a.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator*(
    const Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& factor) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] * Scalar(factor))
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator/(
    const Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& divisor) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] / Scalar(divisor))
  return out;
}

template <typename Scalar, int rows, int inner, int cols, int left, int right>
  requires(kernel::fixed<rows, cols> && inner != Eigen::Dynamic)
[[nodiscard]] JML_INLINE inline Matrix<Scalar, rows, cols> operator*(
    const Eigen::Matrix<Scalar, rows, inner, left>& a, const Eigen::Matrix<Scalar, inner, cols, right>& b) {
  Matrix<Scalar, rows, cols> out;
  if constexpr (rows * inner * cols <= 27) {
    JML_WRITTEN_OUT for (int j = 0; j < cols; ++j) {
      JML_WRITTEN_OUT for (int i = 0; i < rows; ++i) {
        Scalar sum(0);
        JML_WRITTEN_OUT for (int k = 0; k < inner; ++k) sum += a(i, k) * b(k, j);
        out(i, j) = sum;
      }
    }
  } else {
    for (int j = 0; j < cols; ++j) {
      Scalar column[rows] = {};  // of the product: in registers, whatever `out` may share its memory with
      for (int k = 0; k < inner; ++k) {
        const Scalar factor = b(k, j);
        for (int i = 0; i < rows; ++i) column[i] += a(i, k) * factor;
      }
      for (int i = 0; i < rows; ++i) out(i, j) = column[i];
    }
  }
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator+=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  JML_EACH(i, rows * cols, a.data()[i] += b.data()[i])
  return a;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator-=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  JML_EACH(i, rows * cols, a.data()[i] -= b.data()[i])
  return a;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator*=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& factor) {
  JML_EACH(i, rows * cols, a.data()[i] *= Scalar(factor))
  return a;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] inline bool operator==(const Eigen::Matrix<Scalar, rows, cols, options>& a,
                                     const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  for (int i = 0; i < rows * cols; ++i) {
    if (!(a.data()[i] == b.data()[i])) return false;
  }
  return true;
}

}  // namespace operators

using namespace operators;

}  // namespace jml

#undef JML_EACH
#undef JML_WRITTEN_OUT
