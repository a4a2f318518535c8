// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small factorisations of compile-time size: L D Lᵀ, LU, and a root of any rank. Pivots are judged against
/// the rounding of the entry they came from, so no test depends on units. Eigen's own cost 40 % of a
/// two-state step.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>

namespace jml::kernel {

/// S = L D Lᵀ of a symmetric positive definite p×p matrix (lower triangle read). No roots.
template <typename Scalar, int p>
struct SymmetricFactor {
  Matrix<Scalar, p, p> lower;          // unit lower triangle
  Vector<Scalar, p> inverse_diagonal;  // 1/D

  /// False where a pivot is below the rounding of the entry it came from: singular, indefinite or NaN.
  [[nodiscard]] JML_INLINE bool factor(const Matrix<Scalar, p, p>& s) {
    constexpr Scalar slack = Scalar(4 * p) * std::numeric_limits<Scalar>::epsilon();
    if constexpr (p == 1) {
      inverse_diagonal(0) = Scalar(1) / s(0, 0);
      return s(0, 0) > Scalar(0) && s(0, 0) <= std::numeric_limits<Scalar>::max();
    }
    // Two divisions side by side, where the loop has one after the other. Not in float: S_00 S_11 may
    // underflow.
    if constexpr (p == 2 && std::numeric_limits<Scalar>::max_exponent > 1000) {
      const Scalar rest = s(0, 0) * s(1, 1) - s(1, 0) * s(1, 0);
      inverse_diagonal(0) = Scalar(1) / s(0, 0);
      inverse_diagonal(1) = s(0, 0) / rest;
      lower(1, 0) = s(1, 0) * inverse_diagonal(0);
      bool positive = s(0, 0) > Scalar(0);
      positive &= s(1, 1) > Scalar(0);
      positive &= rest > slack * (s(0, 0) * s(1, 1));
      positive &= rest <= std::numeric_limits<Scalar>::max();
      return positive;
    }
    assign(lower, s);
    bool positive = true;
    repeat<p>([&](int k) JML_INLINE {
      const Scalar pivot = lower(k, k);
      positive &= pivot > slack * s(k, k) && s(k, k) > Scalar(0);
      const Scalar inverse = Scalar(1) / pivot;
      inverse_diagonal(k) = inverse;
      between(k + 1, p, [&](int j) JML_INLINE {
        const Scalar factor = lower(j, k) * inverse;
        between(j, p, [&](int i) JML_INLINE { lower(i, j) -= lower(i, k) * factor; });
      });
      between(k + 1, p, [&](int i) JML_INLINE { lower(i, k) *= inverse; });
    });
    return positive;
  }

  /// bᵀ S⁻¹ b.
  [[nodiscard]] JML_INLINE Scalar squared_norm(const Vector<Scalar, p>& b) const {
    if constexpr (p == 1) return b(0) * b(0) * inverse_diagonal(0);
    Vector<Scalar, p> z;
    assign(z, b);
    Scalar sum = 0;
    repeat<p>([&](int i) JML_INLINE {
      between(0, i, [&](int k) JML_INLINE { z(i) -= lower(i, k) * z(k); });
      sum += z(i) * z(i) * inverse_diagonal(i);
    });
    return sum;
  }

  /// S⁻¹ b.
  [[nodiscard]] JML_INLINE Vector<Scalar, p> solve(const Vector<Scalar, p>& b) const {
    Vector<Scalar, p> z;
    assign(z, b);
    repeat<p>([&](int i)
                  JML_INLINE { between(0, i, [&](int k) JML_INLINE { z(i) -= lower(i, k) * z(k); }); });
    repeat<p>([&](int back) JML_INLINE {
      const int i = p - 1 - back;
      z(i) *= inverse_diagonal(i);
      between(i + 1, p, [&](int k) JML_INLINE { z(i) -= lower(k, i) * z(k); });
    });
    return z;
  }

  /// v = w L⁻ᵀ and gain = w S⁻¹, for n×p w. Then w S⁻¹ wᵀ = (v D⁻¹) vᵀ; `scaled` is v D⁻¹.
  template <int n>
  JML_INLINE void right_solve(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& v,
                              Matrix<Scalar, n, p>& scaled, Matrix<Scalar, n, p>& gain) const {
    if constexpr (p == 1) {
      assign(v, w);
      kernel::scale(scaled, inverse_diagonal(0), w);
      kernel::scale(gain, inverse_diagonal(0), w);
    } else if constexpr (p <= 3 && n <= 3) {
      repeat<p>([&](int j) JML_INLINE {
        repeat<n>([&](int i) JML_INLINE {
          Scalar sum = w(i, j);
          between(0, j, [&](int k) JML_INLINE { sum -= v(i, k) * lower(j, k); });
          v(i, j) = sum;
          scaled(i, j) = sum * inverse_diagonal(j);
        });
      });
      repeat<p>([&](int back) JML_INLINE {
        const int j = p - 1 - back;
        repeat<n>([&](int i) JML_INLINE {
          Scalar sum = scaled(i, j);
          between(j + 1, p, [&](int k) JML_INLINE { sum -= gain(i, k) * lower(k, j); });
          gain(i, j) = sum;
        });
      });
    } else {
      if constexpr (n * p > 32)
        right_solve_apart(w, v, scaled, gain);
      else
        right_solve_columns(w, v, scaled, gain);
    }
  }

 private:
  /// f(begin), …, f(end - 1), written out where p is small; see repeat().
  template <typename F>
  JML_INLINE static void between(int begin, int end, const F& f) {
    if constexpr (p <= 3) {
      repeat<p>([&](int i) JML_INLINE {
        if (i >= begin && i < end) f(i);
      });
    } else {
      for (int i = begin; i < end; ++i) f(i);
    }
  }
  // Out of the step, whose registers it would take: a tenth of it at n = 15.
  template <int n>
  JML_NOINLINE void right_solve_apart(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& v,
                                      Matrix<Scalar, n, p>& scaled, Matrix<Scalar, n, p>& gain) const {
    right_solve_columns(w, v, scaled, gain);
  }
  template <int n>
  void right_solve_columns(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& v,
                           Matrix<Scalar, n, p>& scaled, Matrix<Scalar, n, p>& gain) const {
    for (int j = 0; j < p; ++j) {
      copy_column(w, j, v, j);
      for (int k = 0; k < j; ++k) subtract_column(v, k, lower(j, k), v, j);
      scale_column(v, j, inverse_diagonal(j), scaled, j);
    }
    for (int j = p - 1; j >= 0; --j) {
      copy_column(scaled, j, gain, j);
      for (int k = j + 1; k < p; ++k) subtract_column(gain, k, lower(k, j), gain, j);
    }
  }
};

/// S Π = L U of a general p×p matrix, columns exchanged for the largest pivot.
template <typename Scalar, int p>
struct GeneralFactor {
  Matrix<Scalar, p, p> lu;  // unit lower triangle, and U above it
  Vector<Scalar, p> inverse_diagonal;
  int order[p];

  /// `scale(i)`: the size of a unit of component i (√R_ii; with p = 1 R itself), which makes the pivot test
  /// free of units. False where S is singular to rounding relative to that scale, or not finite.
  [[nodiscard]] JML_INLINE bool factor(const Matrix<Scalar, p, p>& s, const Vector<Scalar, p>& scale) {
    constexpr Scalar slack = Scalar(4 * p) * std::numeric_limits<Scalar>::epsilon();
    if constexpr (p == 1) {
      order[0] = 0;
      inverse_diagonal(0) = Scalar(1) / s(0, 0);
      const Scalar size = std::abs(s(0, 0));
      return size > slack * scale(0) && size <= std::numeric_limits<Scalar>::max();
    }
    assign(lu, s);
    for (int j = 0; j < p; ++j) order[j] = j;
    bool regular = true;
    for (int k = 0; k < p; ++k) {
      int best = k;
      for (int j = k + 1; j < p; ++j) {
        if (std::abs(lu(k, j)) * scale(order[best]) > std::abs(lu(k, best)) * scale(order[j])) best = j;
      }
      if (best != k) {
        swap_columns(lu, k, best);
        std::swap(order[k], order[best]);
      }
      const Scalar pivot = lu(k, k);
      const Scalar floor = scale(k) * scale(order[k]) + std::abs(s(k, order[k]));
      regular &= std::abs(pivot) > slack * floor && std::isfinite(pivot);
      const Scalar inverse = Scalar(1) / pivot;
      inverse_diagonal(k) = inverse;
      for (int i = k + 1; i < p; ++i) lu(i, k) *= inverse;
      for (int j = k + 1; j < p; ++j) {
        for (int i = k + 1; i < p; ++i) lu(i, j) -= lu(i, k) * lu(k, j);
      }
    }
    return regular;
  }

  /// gain = w S⁻¹, for n×p w.
  template <int n>
  void right_solve(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& gain) const {
    if constexpr (p == 1) {
      kernel::scale(gain, inverse_diagonal(0), w);
      return;
    }
    for (int j = 0; j < p; ++j) {
      copy_column(w, order[j], gain, j);
      for (int k = 0; k < j; ++k) subtract_column(gain, k, lu(k, j), gain, j);
      scale_column(gain, j, inverse_diagonal(j), gain, j);
    }
    for (int j = p - 1; j >= 0; --j) {
      for (int k = j + 1; k < p; ++k) subtract_column(gain, k, lu(k, j), gain, j);
    }
  }

  /// S⁻¹ b.
  [[nodiscard]] Vector<Scalar, p> solve(const Vector<Scalar, p>& b) const {
    Vector<Scalar, p> z = b;
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) z(i) -= lu(i, k) * z(k);
    }
    for (int i = p - 1; i >= 0; --i) {
      for (int k = i + 1; k < p; ++k) z(i) -= lu(i, k) * z(k);
      z(i) *= inverse_diagonal(i);
    }
    Vector<Scalar, p> x;
    for (int j = 0; j < p; ++j) x(order[j]) = z(j);
    return x;
  }
};

/// a = L Lᵀ of a symmetric positive semidefinite n×n matrix (lower triangle read), of any rank.
template <typename Scalar, int n>
struct SemidefiniteFactor {
  Matrix<Scalar, n, n> L =
      kernel::zeros<Matrix<Scalar, n, n>>();  // columns in pivot order; zero beyond the rank
  int pivot[n];
  int rank = 0;

  /// Cholesky with diagonal pivoting. What is left when no pivot rises above the rounding of its own diagonal
  /// entry is cut to zero, negative parts included; the test is relative to each entry, so units do not
  /// matter.
  explicit SemidefiniteFactor(const Matrix<Scalar, n, n>& a) {
    constexpr Scalar slack = Scalar(4 * n) * std::numeric_limits<Scalar>::epsilon();
    Vector<Scalar, n> left = diagonal(a);
    for (int k = 0; k < n; ++k) {
      int best = -1;
      Scalar largest = slack;  // of what is left of a diagonal entry, relative to the entry
      for (int i = 0; i < n; ++i) {
        if (left(i) > largest * a(i, i)) {
          best = i;
          largest = left(i) / a(i, i);
        }
      }
      if (best < 0) break;
      const Scalar root = std::sqrt(left(best));
      for (int i = 0; i < n; ++i) {
        Scalar sum = i >= best ? a(i, best) : a(best, i);
        for (int j = 0; j < k; ++j) sum -= L(i, j) * L(best, j);
        L(i, k) = i == best ? root : sum / root;
        left(i) = i == best ? Scalar(0) : left(i) - L(i, k) * L(i, k);
      }
      pivot[k] = best;
      rank = k + 1;
    }
  }

  /// c with L c = b, for a b in the range of a; zero beyond the rank.
  [[nodiscard]] Vector<Scalar, n> coordinates(const Vector<Scalar, n>& b) const {
    Vector<Scalar, n> left = b, out = kernel::zeros<Vector<Scalar, n>>();
    for (int k = 0; k < rank; ++k) {
      out(k) = left(pivot[k]) / L(pivot[k], k);
      for (int i = 0; i < n; ++i) left(i) -= out(k) * L(i, k);
    }
    return out;
  }

  /// out = bᵀ a⁺ b for a b in the range of a; false where some entry of b is farther from it than `slack`
  /// allows.
  [[nodiscard]] bool squared_norm(const Vector<Scalar, n>& b, const Vector<Scalar, n>& slack,
                                  Scalar& out) const {
    Vector<Scalar, n> left = b;
    out = 0;
    for (int k = 0; k < rank; ++k) {
      const Scalar c = left(pivot[k]) / L(pivot[k], k);
      for (int i = 0; i < n; ++i) left(i) -= c * L(i, k);
      out += c * c;
    }
    bool within = true;
    for (int i = 0; i < n; ++i) within &= std::abs(left(i)) <= slack(i);
    return within;
  }
};

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
