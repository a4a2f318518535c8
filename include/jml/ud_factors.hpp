// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// P = U D Uᵀ, U unit upper triangular, D ≥ 0: a covariance that no rounding can make indefinite.
///
/// Thornton's time update by weighted Gram-Schmidt and Bierman's measurement update, row by row (G. J.
/// Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapters V and VI; theory of
/// their limits: ud_extended.hpp). The inner loops run down columns in packets. Entries below the diagonal of
/// U are zero and its diagonal is one, so that a packet may reach over them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/strips.hpp>

namespace jml {

/// U (n×n, unit upper triangular) and D (n, ≥ 0) of P = U D Uᵀ.
template <typename Scalar, int n>
struct UdFactors {
  Matrix<Scalar, n, n> U = kernel::zeros<Matrix<Scalar, n, n>>();  ///< n×n, unit upper triangular
  Vector<Scalar, n> D = kernel::zeros<Vector<Scalar, n>>();        ///< n, ≥ 0; infinite: not known
};

namespace kernel {

/// An n×m matrix with rows added, of any content, so that whole packets cover a column.
template <typename Scalar, int n, int m>
using Padded = Matrix<Scalar, Strip<Scalar, n>::padded, m>;

/// F U of a unit upper triangular U, n×n, into the last n columns of W.
template <typename Scalar, int n, int m>
JML_INLINE inline void times_unit_upper(const Matrix<Scalar, n, n>& F, const Matrix<Scalar, n, n>& U,
                                        Padded<Scalar, n, m>& W) {
  for (int j = 0; j < n; ++j) {
    Strip<Scalar, n>::each(n, [&](int i, auto sum) JML_INLINE {
      sum.load(&F(i, j));
      for (int k = 0; k < j; ++k) {
        auto column = sum;
        column.load(&F(i, k));
        sum.add(column, U(k, j));
      }
      sum.store(&W(i, m - n + j));
    });
    for (int i = n; i < Strip<Scalar, n>::padded; ++i) W(i, m - n + j) = Scalar(0);
  }
}

/// orthogonalise() of few states, one row at a time: what it waits for is shorter. Each way through W takes
/// row j out of the rows above it, and gathers their products with row j - 1 as it comes.
template <typename Scalar, int n, int m>
JML_INLINE inline void orthogonalise_few(Padded<Scalar, n, m>& W, const Vector<Scalar, m>& d,
                                         UdFactors<Scalar, n>& out) {
  constexpr int rows = Strip<Scalar, n>::padded;
  Scalar dots[rows];
  {
    Column<Scalar, rows> even, odd, column;
    even.clear();
    odd.clear();
    for (int k = 0; k < m; ++k) {
      column.load(&W(0, k));
      (k % 2 == 0 ? even : odd).add(column, d(k) * W(n - 1, k));
    }
    even.add(odd, Scalar(1));
    even.store(dots);
  }
  const auto take_out = [&]<int j>() JML_INLINE {
    constexpr int width = Strip<Scalar, n>::width;
    const Scalar sum = dots[j], inverse = sum > Scalar(0) ? Scalar(1) / sum : Scalar(0);
    out.D(j) = sum;
    for (int i = 0; i < n; ++i) out.U(i, j) = i < j ? dots[i] * inverse : Scalar(i == j);
    if constexpr (j > 0) {
      Column<Scalar, (j + width - 1) / width * width> factor, even, odd, column;  // rows above j
      factor.load(dots);
      factor.scale(inverse);
      even.clear();
      odd.clear();
      for (int k = 0; k < m; ++k) {
        column.load(&W(0, k));
        column.subtract(factor, W(j, k));
        column.store(&W(0, k));
        (k % 2 == 0 ? even : odd).add(column, d(k) * W(j - 1, k));
      }
      even.add(odd, Scalar(1));
      even.store(dots);
    }
  };
  [&]<int... back>(std::integer_sequence<int, back...>) JML_INLINE {
    (take_out.template operator()<n - 1 - back>(), ...);
  }(std::make_integer_sequence<int, n>{});
}

/// U D Uᵀ = W diag(d) Wᵀ by weighted Gram-Schmidt from the last row up. W is overwritten. `triangular`: the
/// first n columns of W are an upper triangle, whose zeros are not touched.
///
/// Two rows j and j - 1 at a time, for half the way through W: with what rounding has left of their product,
/// `rest`, the second takes from a row i the same as if it had come after the first.
template <bool triangular, typename Scalar, int n, int m>
JML_INLINE inline void orthogonalise(Padded<Scalar, n, m>& W, const Vector<Scalar, m>& d,
                                     UdFactors<Scalar, n>& out) {
  if constexpr (n <= 8) return orthogonalise_few<Scalar, n, m>(W, d, out);
  constexpr int rows = Strip<Scalar, n>::padded;
  constexpr int length = (m + 3) / 4 * 4;  // of a row of W, with zeros
  using Row = Strip<Scalar, length>;
  Scalar last[length] = {}, weighted_last[length], next[length] = {}, weighted_next[length];
  Scalar weights[length] = {}, above[rows], above_next[rows];
  for (int k = 0; k < m; ++k) weights[k] = d(k);
  const auto divisor = [](Scalar sum) { return sum > Scalar(0) ? Scalar(1) / sum : Scalar(0); };
  const auto unit_below = [&out](int j) {
    for (int i = j; i < n; ++i) out.U(i, j) = Scalar(i == j);
  };
  int j = n - 1;
  for (; j >= 1; j -= 2) {
    const int begin = triangular ? j - 1 : 0;
    for (int k = 0; k < m; ++k) {
      last[k] = W(j, k);
      next[k] = W(j - 1, k);
    }
    Row::product(weights, last, weighted_last);
    const Scalar sum = Row::dot(m, weighted_last, last), inverse = divisor(sum);
    const Scalar shared = Row::dot(m, weighted_last, next) * inverse;
    Row::subtract(next, last, shared);
    Row::product(weights, next, weighted_next);
    const Scalar rest = Row::dot(m, weighted_next, last), sum_next = Row::dot(m, weighted_next, next);
    const Scalar inverse_next = divisor(sum_next);
    out.D(j) = sum;
    out.D(j - 1) = sum_next;
    Strip<Scalar, rows>::each(j - 1, [&](int i, auto dot) JML_INLINE {
      auto dot_next = dot, row = dot;
      dot.clear();
      dot_next.clear();
      for (int k = begin; k < m; ++k) {
        row.load(&W(i, k));
        dot.add(row, weighted_last[k]);
        dot_next.add(row, weighted_next[k]);
      }
      dot.scale(inverse);
      dot_next.subtract(dot, rest);
      dot_next.scale(inverse_next);
      for (int k = begin; k < m; ++k) {
        row.load(&W(i, k));
        row.subtract(dot, last[k]);
        row.subtract(dot_next, next[k]);
        row.store(&W(i, k));
      }
      dot.store(above + i);
      dot_next.store(above_next + i);
    });
    for (int i = 0; i < j - 1; ++i) {
      out.U(i, j) = above[i];
      out.U(i, j - 1) = above_next[i];
    }
    unit_below(j);
    unit_below(j - 1);
    out.U(j - 1, j) = shared;
  }
  if (j == 0) {
    Scalar sum = 0;
    for (int k = 0; k < m; ++k) sum += d(k) * W(0, k) * W(0, k);
    out.D(0) = sum;
    unit_below(0);
  }
}

/// Bierman's update with one row h of variance r > 0: the factors in place, `gain` = P hᵀ and the innovation
/// variance alpha = h P hᵀ + r.
template <typename Scalar, int n>
JML_INLINE inline void correct_row(UdFactors<Scalar, n>& P, const Scalar* h, Scalar r,
                                   Vector<Scalar, n>& gain, Scalar& alpha) {
  constexpr bool in_registers = Column<Scalar, n>::count <= 8;
  Scalar f[n], g[n], ratio[n];
  if constexpr (in_registers) {
    Column<Scalar, n> row, u;
    row.load(h);
    for (int j = 0; j < n; ++j) {  // f = Uᵀ h
      u.load(&P.U(0, j));
      f[j] = u.dot(row);
    }
  } else {
    for (int j = 0; j < n; ++j) f[j] = Strip<Scalar, n>::dot(j + 1, &P.U(0, j), h);
  }
  Scalar before = r, inverse = Scalar(1) / r;
  for (int j = 0; j < n; ++j) {  // the sums r + Σ f² D, whose divisions do not wait for each other
    g[j] = P.D(j) * f[j];
    const Scalar after = before + f[j] * g[j];
    ratio[j] = -f[j] * inverse;
    inverse = Scalar(1) / after;
    P.D(j) *= before * inverse;
    before = after;
  }
  alpha = before;
  // b_i = 0 for i ≥ j, and with U_jj = 1 row j becomes g.
  if constexpr (in_registers) {
    Column<Scalar, n> u, b, next;
    b.clear();
    for (int j = 0; j < n; ++j) {
      u.load(&P.U(0, j));
      next = b;
      next.add(u, g[j]);
      u.add(b, ratio[j]);
      b = next;
      u.store(&P.U(0, j));
    }
    b.store(gain.data());
  } else {
    kernel::set_zero(gain);
    for (int j = 0; j < n; ++j) {
      Strip<Scalar, n>::each(j + 1, [&](int i, auto u) JML_INLINE {
        auto b = u, next = u;
        u.load(&P.U(i, j));
        b.load(&gain(i));
        next = b;
        next.add(u, g[j]);
        u.add(b, ratio[j]);
        u.store(&P.U(i, j));
        next.store(&gain(i));
      });
    }
  }
}

}  // namespace kernel

}  // namespace jml
#include <jml/warnings_end.hpp>
