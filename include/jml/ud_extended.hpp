// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// P = U D Uᵀ moved in twice the digits: what the fast forms hand over to where their own digits end.
///
/// Thornton's time update (weighted Gram-Schmidt), Bierman's measurement update (G. J. Bierman, Factorization
/// Methods for Discrete Sequential Estimation, 1977, chapters V and VI), and the limit D_j → ∞ of both:
/// column j of U is then a direction of which nothing is known yet. Sizes are arguments, so that one copy of
/// this rare code serves every filter of a program. Matrices column by column; nothing below the unit
/// diagonal of U.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <jml/twofold.hpp>

namespace jml::detail {

/// What one row of measurements did.
enum class RowUse : std::uint8_t {
  used,
  resolved,   ///< it gave a variance to a direction that had none
  redundant,  ///< a perfect row (variance 0) of what is known exactly: only its residual tells anything
};

/// Factors of n states in memory of the caller, T = Extended<Scalar>.
template <typename Scalar>
struct ExtendedUd {
  using T = Extended<Scalar>;
  int n;
  T* U;              // n×n, unit upper triangle
  T* D;              // n, ≥ 0 or infinite
  Scalar noise = 1;  // of U and D as they are, in their rounding: of factors of a dense P its magnification

  static Scalar upper(const T& a) { return static_cast<Scalar>(in_two<Scalar>(a).high); }
  static Scalar size_of(const T& a) { return std::abs(upper(a)); }
  static bool infinite(const T& a) { return std::isinf(upper(a)); }
  /// A sum of n terms that is zero but for rounding is at most this times the sum of their sizes.
  static Scalar rounding(int n) { return Scalar(16 * n) * extended_epsilon<Scalar>; }

  T& u(int i, int j) const { return U[i + j * n]; }

  /// From the upper triangle of a dense P in U; an infinite variance asks for zeros beside it. `epsilon`: of
  /// the numbers that P was given in. Pivot j is m P mᵀ with row m of U⁻¹; what their rounding alone may have
  /// made of it, ε (Σ |m_k| √P_kk)², is zero. False where P is indefinite.
  [[nodiscard]] JML_RARE bool factor(Scalar epsilon) const {
    const Scalar slack = Scalar(2 * n) * epsilon;
    for (int j = 0; j < n; ++j) D[j] = u(j, j);
    for (int j = n - 1; j >= 0; --j) {
      const T pivot = u(j, j);
      const Scalar size = scaled_inverse_row(j), least = slack * size * size;
      if (!(upper(pivot) >= -least)) return false;
      const bool unknown = infinite(pivot), regular = !unknown && upper(pivot) > least;
      D[j] = regular || unknown ? pivot : T(0);
      for (int i = 0; i < j; ++i) u(i, j) = regular ? u(i, j) / pivot : T(0);
      for (int k = 0; k < j && regular; ++k) {
        if (size_of(u(k, j)) == Scalar(0)) continue;  // beside an infinite variance too
        const T part = u(k, j) * pivot;
        for (int i = 0; i <= k; ++i) u(i, k) = u(i, k) - u(i, j) * part;
      }
    }
    for (int j = 0; j < n; ++j) {
      u(j, j) = T(1);
      for (int i = j + 1; i < n; ++i) u(i, j) = T(0);
    }
    return true;
  }

  /// √P_ii to a few digits; infinite where a direction of which nothing is known reaches x_i.
  JML_RARE void deviations(Scalar* sd) const {
    for (int i = 0; i < n; ++i) {
      Scalar sum = 0;
      for (int j = i; j < n; ++j) {
        const Scalar part = size_of(u(i, j));
        if (part > Scalar(0)) sum += part * part * upper(D[j]);
      }
      sd[i] = std::sqrt(sum);
    }
  }

  /// U D Uᵀ = Σ d_k w_k w_kᵀ of the m columns of W (n×m, overwritten). `size`: of row i the sum of the sizes
  /// of all terms that it came from, a standard deviation; what cannot be told from zero beside it is zero.
  /// `bulk` (n×m): the same of each entry of a column with infinite weight.
  JML_RARE void triangularise(int m, T* W, const T* d, Scalar* size, Scalar* bulk) const {
    const Scalar small = rounding(n + m);
    for (int j = n - 1; j >= 0; --j) {
      for (int i = 0; i < n; ++i) u(i, j) = T(i == j ? 1 : 0);
      int best = -1;
      Scalar largest = small;
      for (int k = 0; k < m; ++k) {
        if (!infinite(d[k]) || bulk[j + k * n] < Scalar(0)) continue;
        const Scalar share = size_of(W[j + k * n]) / bulk[j + k * n];
        if (share > largest) {
          best = k;
          largest = share;
        }
      }
      if (best >= 0) {  // x_j is known along no finite direction: take what is not known as its column
        const T pivot = W[j + best * n];
        D[j] = d[best];
        for (int i = 0; i < j; ++i) u(i, j) = W[i + best * n] / pivot;
        for (int i = 0; i < j; ++i) size[i] += size_of(u(i, j)) * size[j];
        for (int k = 0; k < m; ++k) {
          const T part = W[j + k * n];
          for (int i = 0; i < j; ++i) {
            W[i + k * n] = W[i + k * n] - u(i, j) * part;
            bulk[i + k * n] += size_of(u(i, j)) * size_of(part);
          }
          W[j + k * n] = T(0);
        }
        for (int i = 0; i < n; ++i) bulk[i + best * n] = Scalar(-1);  // used
        continue;
      }
      T sum(0);
      for (int k = 0; k < m; ++k) {
        if (infinite(d[k])) {
          W[j + k * n] = T(0);
          continue;
        }
        sum = sum + d[k] * W[j + k * n] * W[j + k * n];
      }
      const Scalar zero = noise * small * size[j];
      D[j] = upper(sum) <= zero * zero ? T(0) : sum;  // what is no number stays none
      if (upper(D[j]) == Scalar(0)) continue;
      for (int i = 0; i < j; ++i) {
        T dot(0);
        for (int k = 0; k < m; ++k) {
          if (!infinite(d[k])) dot = dot + d[k] * W[j + k * n] * W[i + k * n];
        }
        const T factor = dot / sum;
        u(i, j) = factor;
        for (int k = 0; k < m; ++k) {
          if (!infinite(d[k])) W[i + k * n] = W[i + k * n] - factor * W[j + k * n];
        }
      }
    }
    for (int i = 0; i < n; ++i) {  // a state that no direction reaches by more than rounding is known
      const Scalar zero = noise * small * size[i];
      Scalar sum = 0;
      for (int k = i; k < n; ++k) {
        const Scalar part = size_of(u(i, k));
        if (part > Scalar(0)) sum += part * part * upper(D[k]);
      }
      for (int k = i + 1; k < n && sum <= zero * zero; ++k) u(i, k) = T(0);
    }
  }

  /// P ← F P Fᵀ + B diag(d_B) Bᵀ, F n×n (null: I), B n×q. Memory of the caller: W n×(n+q), d and bulk as in
  /// triangularise(), size n.
  JML_RARE void propagate(const Scalar* F, int q, const T* B, const T* d_B, T* W, T* d, Scalar* size,
                          Scalar* bulk) const {
    deviations(size);
    spread_sizes(F, q, B, d_B, size, W);
    for (int j = 0; j < n; ++j) {
      d[j] = D[j];
      for (int i = 0; i < n; ++i) {
        T sum(F == nullptr ? u(i, j) : T(0));
        Scalar sizes = size_of(sum);
        for (int k = 0; F != nullptr && k <= j; ++k) {
          sum = sum + T(F[i + k * n]) * u(k, j);
          sizes += std::abs(F[i + k * n]) * size_of(u(k, j));
        }
        W[i + j * n] = sum;
        bulk[i + j * n] = sizes;
      }
    }
    for (int k = 0; k < n * q; ++k) {
      W[n * n + k] = B[k];
      bulk[n * n + k] = size_of(B[k]);
    }
    for (int k = 0; k < q; ++k) d[n + k] = d_B[k];
    triangularise(n + q, W, d, size, bulk);
  }

  /// One row h (n) of measurements with variance r ≥ 0. gain: n, of the innovation; alpha: its variance
  /// h P hᵀ + r, infinite where the row resolved a direction. Memory as in propagate() with q = 1.
  [[nodiscard]] JML_RARE RowUse correct(const T* h, const T& r, T* gain, T& alpha, T* f, T* W, T* d,
                                        Scalar* size, Scalar* bulk) const {
    int free = -1;
    Scalar sizes = 0;
    deviations(size);
    for (int j = 0; j < n; ++j) {
      T sum(0);
      Scalar terms = 0;
      for (int i = 0; i <= j; ++i) {
        sum = sum + u(i, j) * h[i];
        terms += size_of(u(i, j)) * size_of(h[i]);
      }
      if (size_of(sum) <= rounding(n) * terms) sum = T(0);
      f[j] = sum;
      if (!infinite(D[j])) sizes += terms * std::sqrt(upper(D[j]));
      if (infinite(D[j]) && free < 0 && size_of(sum) > Scalar(0)) free = j;
    }
    if (free >= 0) return resolve(free, r, gain, alpha, f, W, d, size, bulk);

    alpha = r;
    for (int j = 0; j < n; ++j) {
      if (!infinite(D[j])) alpha = alpha + f[j] * f[j] * D[j];
    }
    const Scalar zero = noise * rounding(n) * sizes;
    if (!(upper(r) > Scalar(0)) && upper(alpha) <= zero * zero) return RowUse::redundant;
    T before = r;
    for (int j = 0; j < n; ++j) {
      const T g = infinite(D[j]) ? T(0) : D[j] * f[j];
      const T after = before + f[j] * g;
      const T ratio = upper(before) > Scalar(0) ? -(f[j] / before) : T(0);
      gain[j] = g;
      for (int i = 0; i < j; ++i) {
        const T old = u(i, j);
        if (!infinite(D[j])) u(i, j) = old + gain[i] * ratio;
        gain[i] = gain[i] + old * g;
      }
      if (!infinite(D[j]) && upper(after) > Scalar(0)) D[j] = D[j] * (before / after);
      before = after;
    }
    for (int i = 0; i < n; ++i) gain[i] = gain[i] / alpha;
    return RowUse::used;
  }

  /// The largest share of rounding in any direction, in units of that of T: 1 where the states are
  /// uncorrelated, the root of the condition number where they are not. `sd`: √ of the sums that P came from.
  /// `own`: the same as sd, of the state itself whose direction it is. An exact zero in D counts for nothing:
  /// a direction that is known exactly stays so. row: n.
  [[nodiscard]] JML_RARE Scalar magnification(const Scalar* sd, const Scalar* own, T* row) const {
    Scalar most = 1;
    for (int i = 0; i < n; ++i) {
      if (infinite(D[i]) || !(upper(D[i]) > Scalar(0))) continue;
      Scalar sum = 0;
      for (int k = i; k < n; ++k) {  // row i of U⁻¹: of all states what is left beside those behind them
        row[k] = T(k == i ? 1 : 0);
        for (int l = i; l < k; ++l) row[k] = row[k] - row[l] * u(l, k);
        const Scalar size = k == i ? own[k] : sd[k];
        if (!infinite(D[k])) sum += size_of(row[k]) * (std::isinf(size) ? Scalar(1) : size);
      }
      const Scalar ratio = sum / std::sqrt(upper(D[i]));
      if (!(ratio <= most)) most = ratio;
    }
    return most;
  }

 private:
  /// m_k √P_kk of row j of U⁻¹, which is placed below the diagonal of column j, from those behind it. Σ |·|.
  JML_RARE Scalar scaled_inverse_row(int j) const {
    u(j, j) = T(infinite(D[j]) ? Scalar(0) : std::sqrt(size_of(D[j])));
    Scalar sum = upper(u(j, j));
    for (int k = j + 1; k < n; ++k) {
      T entry(0);
      for (int l = j + 1; l <= k; ++l) entry = entry - u(j, l) * u(k, l);
      u(k, j) = entry;
      sum += size_of(entry);
    }
    return sum;
  }

  /// size ← |F| size + Σ |B| √d_B. spare: n numbers.
  JML_RARE void spread_sizes(const Scalar* F, int q, const T* B, const T* d_B, Scalar* size, T* spare) const {
    for (int i = 0; i < n; ++i) {
      Scalar sum = F == nullptr ? size[i] : Scalar(0);
      for (int k = 0; F != nullptr && k < n; ++k) {
        if (F[i + k * n] != Scalar(0) && !std::isinf(size[k])) sum += std::abs(F[i + k * n]) * size[k];
      }
      for (int k = 0; k < q; ++k) {
        if (!infinite(d_B[k])) sum += size_of(B[i + k * n]) * std::sqrt(upper(d_B[k]));
      }
      spare[i] = T(sum);
    }
    for (int i = 0; i < n; ++i) size[i] = upper(spare[i]);
  }

  /// The limit of Bierman's update for an infinite D_free: the row fixes that direction, and P of the rest is
  /// carried along it: (I - k h) P (I - k h)ᵀ + k r kᵀ with k = u_free / f_free.
  JML_RARE RowUse resolve(int free, const T& r, T* gain, T& alpha, const T* f, T* W, T* d, Scalar* size,
                          Scalar* bulk) const {
    for (int i = 0; i < n; ++i) gain[i] = u(i, free) / f[free];
    for (int j = 0; j < n; ++j) {
      d[j] = j == free ? r : D[j];
      for (int i = 0; i < n; ++i) {
        W[i + j * n] = j == free ? gain[i] : u(i, j) - gain[i] * f[j];
        bulk[i + j * n] = size_of(u(i, j)) + size_of(gain[i]) * size_of(f[j]);
      }
    }
    for (int i = 0; i < n; ++i) {
      Scalar sum = 0;
      for (int j = 0; j < n; ++j) {
        if (!infinite(d[j])) sum += bulk[i + j * n] * std::sqrt(upper(d[j]));
      }
      size[i] = sum;
    }
    triangularise(n, W, d, size, bulk);
    alpha = T(std::numeric_limits<Scalar>::infinity());
    return RowUse::resolved;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
