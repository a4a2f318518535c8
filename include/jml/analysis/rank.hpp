// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The staircase behind the ranks of observability.hpp, where it is explained.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>

namespace jml {

/// Rank of a pair of matrices and how clear it is.
template <typename Scalar>
struct PairRank {
  int rank = 0;  ///< 0 … n
  /// The smallest pivot that was counted, relative to its scale: at full rank of a pair with one input, a
  /// change of the scaled matrices of this relative size takes a state out of reach. 0 where none was
  /// counted.
  Scalar margin = 0;
  Scalar rejected = 0;  ///< the largest pivot that was not counted, relative to its scale: rounding, or 0
};

/// 64 n ε: pivots below it, relative to their scale, are rounding.
template <typename Scalar, int n>
inline constexpr Scalar default_rank_tolerance = Scalar(64 * n) * std::numeric_limits<Scalar>::epsilon();

namespace detail {

/// R^-½ M, p×n, with R = L Lᵀ of full rank as factored.
template <typename Scalar, int p, int n>
Matrix<Scalar, p, n> in_units_of(const kernel::SemidefiniteFactor<Scalar, p>& noise,
                                 const Matrix<Scalar, p, n>& M) {
  Matrix<Scalar, p, n> out;
  for (int k = 0; k < p; ++k) {
    const int row = noise.pivot[k];
    for (int i = 0; i < n; ++i) {
      out(k, i) = M(row, i);
      for (int j = 0; j < k; ++j) out(k, i) -= noise.L(row, j) * out(j, i);
      out(k, i) /= noise.L(row, k);
    }
  }
  return out;
}

/// max_k (tr |F|^k / n)^{1/k}: a rate that no choice of the states' units changes. A nilpotent F has no such
/// rate, but where `start` gets to a state by ways of k and of m < k couplings, their ratio is one of power
/// k - m, and the largest of these is the answer. With neither, the unit of time is free: F's largest entry.
template <typename Scalar, int n>
Scalar natural_rate(const Matrix<Scalar, n, n>& F, const Vector<Scalar, n>& start) {
  const Scalar largest = kernel::largest(F);
  if (!(largest > Scalar(0))) return Scalar(1);
  const Matrix<Scalar, n, n> size = kernel::absolute(F) / largest;
  Matrix<Scalar, n, n> power = size;
  Scalar rate = 0;
  for (int k = 1; k <= n; ++k) {
    Scalar trace = 0;
    for (int i = 0; i < n; ++i) trace += power(i, i);
    rate = std::max(rate, std::pow(trace / Scalar(n), Scalar(1) / Scalar(k)));
    power = power * size;
  }
  if (rate > Scalar(0)) return largest * rate;
  Matrix<Scalar, n, n> reach;
  kernel::set_column(reach, 0, start);
  for (int k = 1; k < n; ++k) {
    kernel::set_column(reach, k, size * kernel::column_of(reach, k - 1));
    for (int m = 0; m < k; ++m) {
      for (int i = 0; i < n; ++i) {
        if (!(reach(i, m) > Scalar(0))) continue;
        rate = std::max(rate, std::pow(reach(i, k) / reach(i, m), Scalar(1) / Scalar(k - m)));
      }
    }
  }
  return largest * (rate > Scalar(0) ? rate : Scalar(1));
}

/// F, in units of its natural rate, without what is rounding in every choice of units: an entry (i, j) that
/// closes a cycle with the best way back, the largest product of entries from i to j, to less than rounding.
/// An entry without a way back is small or large by the choice of units alone, and stays.
template <typename Scalar, int n>
Matrix<Scalar, n, n> without_rounding(const Matrix<Scalar, n, n>& F) {
  Matrix<Scalar, n, n> way = kernel::absolute(F);
  for (int i = 0; i < n; ++i) way(i, i) = Scalar(1);
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) way(i, j) = std::max(way(i, j), way(i, k) * way(k, j));
    }
  }
  Matrix<Scalar, n, n> out = F;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Scalar back = way(j, i);
      if (back > Scalar(0) && std::abs(F(i, j)) * back <= std::numeric_limits<Scalar>::epsilon())
        out(i, j) = Scalar(0);
    }
  }
  return out;
}

/// F and L in units of d (observability.hpp) and of the natural rate.
template <typename Scalar, int n, int q>
void take_units_out(Matrix<Scalar, n, n>& F, Matrix<Scalar, n, q>& L) {
  Vector<Scalar, n> reach = kernel::row_sums(L);
  F = without_rounding(Matrix<Scalar, n, n>(F / natural_rate(F, reach)));
  const Matrix<Scalar, n, n> size = kernel::absolute(F);
  Vector<Scalar, n> unit = reach;
  for (int k = 1; k < n; ++k) {
    reach = size * reach;
    unit += reach;
  }
  for (int i = 0; i < n; ++i) {
    if (unit(i) > Scalar(0)) continue;  // no path leads there: what starts there has no part and no unit
    unit(i) = Scalar(1);
    for (int j = 0; j < n; ++j) F(j, i) = Scalar(0);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < q; ++j) L(i, j) /= unit(i);
    for (int j = 0; j < n; ++j) F(i, j) *= unit(j) / unit(i);
  }
}

/// Rank of [L, F L, …], column by column into an orthonormal basis.
template <typename Scalar, int n, int q>
PairRank<Scalar> staircase(Matrix<Scalar, n, n> F, Matrix<Scalar, n, q> L, Scalar tolerance) {
  PairRank<Scalar> out;
  if (!all_finite(F) || !all_finite(L)) return out;
  take_units_out(F, L);
  constexpr int width = q > n ? q : n;
  Matrix<Scalar, n, n> basis = kernel::zeros<Matrix<Scalar, n, n>>();
  Matrix<Scalar, n, width> candidate = kernel::zeros<Matrix<Scalar, n, width>>();
  kernel::set_block(candidate, 0, 0, L);
  int candidates = q;
  Scalar scale = kernel::norm(L);
  out.margin = std::numeric_limits<Scalar>::infinity();
  for (int block = 0; block <= n && candidates > 0 && scale > Scalar(0); ++block) {
    const int first = out.rank;
    for (int left = candidates; left > 0 && out.rank < n; --left) {
      int best = 0;
      Scalar pivot = -1;
      for (int c = 0; c < left; ++c) {
        for (int pass = 0; pass < 2; ++pass) {
          for (int b = 0; b < out.rank; ++b) {
            const Vector<Scalar, n> direction = kernel::column_of(basis, b),
                                    rest = kernel::column_of(candidate, c);
            kernel::set_column(candidate, c, rest - kernel::dot(direction, rest) * direction);
          }
        }
        const Scalar size = kernel::norm(kernel::column_of(candidate, c));
        if (size > pivot) {
          pivot = size;
          best = c;
        }
      }
      const Scalar relative = pivot / scale;
      if (!(relative > tolerance)) {
        out.rejected = std::max(out.rejected, relative);
        break;
      }
      out.margin = std::min(out.margin, relative);
      kernel::set_column(basis, out.rank++, kernel::column_of(candidate, best) / pivot);
      kernel::set_column(candidate, best, kernel::column_of(candidate, left - 1));
    }
    candidates = out.rank < n ? out.rank - first : 0;
    for (int c = 0; c < candidates; ++c)
      kernel::set_column(candidate, c, F * kernel::column_of(basis, first + c));
    scale = kernel::norm(F);
  }
  if (out.rank == 0) out.margin = 0;
  return out;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
