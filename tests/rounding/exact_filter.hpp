// SPDX-License-Identifier: BSD-3-Clause
// The judge of the covariance generator: Kalman filter and smoother of a linear system in 113-bit arithmetic, and
// how far another answer lies from theirs.
//
// P = S Sᵀ with S lower triangular, moved by orthogonal transformations alone: Householder on [F S, B] for a
// prediction, Givens on [√r, h S; 0, S] for one row of measurements. What rounding makes of P in one step is in
// every direction at most some 1e-34 times the root of the condition number, and later steps do not magnify it
// (a relative change of P, as a matrix inequality, stays that change through prediction and correction). The
// smoother combines the filter with the information of all later measurements, which comes backward as rows
// M x = z + v, cov v = I; judge_test.cpp compares it with a dense least-squares solution. Nothing of the library
// is used here, and its factored form is of another kind (U D Uᵀ by Bierman and Thornton).
//
// What is compared. P is right to `bound` where |vᵀ (P_given - P) v| ≤ bound · vᵀ P v in every direction v. Where P
// is singular, a given P cannot meet that: the numbers it is made of are rounded. There the bound is
//   bound · vᵀ P v + share · vᵀ W v,
// W being what P would gain if each step disturbed each state, independently, by the size of the terms that it
// came from: share (64 ε)² for a P by factors, whose columns are rounded, and 64 ε for a dense one. W is carried
// through the flight as a disturbance is, so that what a later measurement removes of an error it removes of W;
// and a state whose variance is zero, and which no other one reaches, must have zero in all of its row.
// That is fair up to here, and no further: the share of a factored P hides nothing up to a condition of 1e20, and
// is used only above; that of a dense one would hide all errors above 1e14, so that it is used where P is
// singular (condition above 1e28, or variances that cancel to zero) and nowhere else.
#pragma once

#include <quadmath.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace rounding {

__extension__ typedef __float128 Quad;

inline constexpr int most_states = 8, most_rows = 4;
inline constexpr double infinite = std::numeric_limits<double>::infinity();

using QuadVector = std::array<Quad, most_states>;
using QuadMatrix = std::array<std::array<Quad, most_states>, most_states>;

/// a (n×m, one row after another) becomes lower triangular by orthogonal transformations of its columns.
inline void make_lower(Quad* a, int n, int m) {
  std::array<Quad, 4 * most_states> v;
  for (int i = 0; i < n && i < m; ++i) {
    Quad* row = a + i * m;
    int last = i;
    Quad rest = 0;
    for (int k = i + 1; k < m; ++k) {
      if (row[k] == 0) continue;
      rest += row[k] * row[k];
      last = k;
    }
    if (rest == 0) continue;
    const Quad norm = sqrtq(rest + row[i] * row[i]);
    const Quad pivot = row[i] > 0 ? -norm : norm;
    for (int k = i; k <= last; ++k) v[k] = row[k];
    v[i] -= pivot;
    const Quad factor = 1 / (norm * (norm + fabsq(row[i])));  // 2/|v|²
    for (int r = i + 1; r < n; ++r) {
      Quad* other = a + r * m;
      Quad dot = 0;
      for (int k = i; k <= last; ++k) dot += other[k] * v[k];
      dot *= factor;
      for (int k = i; k <= last; ++k) other[k] -= dot * v[k];
    }
    row[i] = pivot;
    for (int k = i + 1; k <= last; ++k) row[k] = 0;
  }
}

/// L with L Lᵀ = a, of a symmetric n×n matrix of doubles (one row after another) of any rank; a pivot below 2⁻⁷⁰ of
/// the entry it came from is zero.
inline QuadMatrix root_of(const double* a, int n) {
  QuadMatrix w{}, L{};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) w[i][j] = a[i * n + j];
  }
  const Quad small = ldexpq(1, -70);
  for (int k = 0; k < n; ++k) {
    if (!(w[k][k] > small * fabsq(a[k * n + k]))) continue;
    L[k][k] = sqrtq(w[k][k]);
    for (int i = k + 1; i < n; ++i) L[i][k] = w[i][k] / L[k][k];
    for (int i = k + 1; i < n; ++i) {
      for (int j = k + 1; j <= i; ++j) w[i][j] -= L[i][k] * L[j][k];
    }
  }
  return L;
}

/// The lower root of U D Uᵀ, U n×n unit upper triangular.
inline QuadMatrix root_of_factors(const double* U, const double* D, int n) {
  std::array<Quad, most_states * most_states> a{};
  for (int j = 0; j < n; ++j) {
    const Quad d = sqrtq(D[j]);
    for (int i = 0; i < j; ++i) a[i * n + j] = U[i * n + j] * d;
    a[j * n + j] = d;
  }
  make_lower(a.data(), n, n);
  QuadMatrix S{};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) S[i][j] = a[i * n + j];
  }
  return S;
}

/// One row of measurements y = h x + v, cov v = r.
struct ExactRow {
  QuadVector h{};
  Quad r = 0, y = 0;
  double cancelled = 1;  ///< of the variance in R, what was left when it was made independent
};

/// The rows of a sensor with H (p×n) and R (p×p), made independent by R = L D Lᵀ.
inline std::vector<ExactRow> independent_rows(const double* H, const double* R, const double* y, int p, int n) {
  std::vector<ExactRow> rows(static_cast<std::size_t>(p));
  std::array<std::array<Quad, most_rows>, most_rows> w{};
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < p; ++j) w[i][j] = R[i * p + j];
    auto& row = rows[static_cast<std::size_t>(i)];
    for (int j = 0; j < n; ++j) row.h[j] = H[i * n + j];
    row.y = y[i];
  }
  for (int k = 0; k < p; ++k) {
    auto& from = rows[static_cast<std::size_t>(k)];
    from.r = w[k][k];
    from.cancelled = static_cast<double>(from.r / R[k * p + k]);
    for (int i = k + 1; i < p; ++i) {
      if (w[i][k] == 0) continue;
      const Quad factor = w[i][k] / w[k][k];
      for (int j = k; j < p; ++j) w[i][j] -= factor * w[k][j];
      auto& to = rows[static_cast<std::size_t>(i)];
      for (int j = 0; j < n; ++j) to.h[j] -= factor * from.h[j];
      to.y -= factor * from.y;
    }
  }
  return rows;
}

/// x and S of P = S Sᵀ, and how they move.
struct Moments {
  int n = 0;
  QuadVector x{};
  QuadMatrix S{};
  QuadVector size{};     ///< of each state, the root of the sum of squares of the terms that it last came from
  bool cancelled = false;  ///< a variance has cancelled to less than 1e-57 of its terms, and was made zero

  /// F n×n, B n×n with B Bᵀ = G Q Gᵀ; `share` of the terms' variance is added to each state.
  void predict(const double* F, const QuadMatrix& B, Quad share) {
    std::array<Quad, most_states * 3 * most_states> a{};
    const int m = share > 0 ? 3 * n : 2 * n;
    const Quad tiny = ldexpq(1, -190);
    QuadVector old = x;
    for (int i = 0; i < n; ++i) {
      Quad* row = a.data() + i * m;
      Quad terms = 0;
      x[i] = 0;
      for (int k = 0; k < n; ++k) {
        const Quad f = F[i * n + k];
        if (f == 0) continue;
        x[i] += f * old[k];
        for (int j = 0; j <= k; ++j) {
          const Quad part = f * S[k][j];
          row[j] += part;
          terms += part * part;
        }
      }
      Quad sum = 0;
      for (int j = 0; j < n; ++j) {
        row[n + j] = B[i][j];
        terms += B[i][j] * B[i][j];
        sum += row[j] * row[j] + B[i][j] * B[i][j];
      }
      size[i] = sqrtq(terms);
      if (sum < tiny * terms) {
        for (int j = 0; j < 2 * n; ++j) row[j] = 0;
        cancelled = true;
      }
      if (share > 0) row[2 * n + i] = sqrtq(share) * size[i];
    }
    make_lower(a.data(), n, m);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) S[i][j] = a[i * m + j];
    }
  }

  void measure(const ExactRow& row, Quad share) {
    QuadVector f{}, gain{};
    for (int i = 0; i < n; ++i) {
      Quad sum = 0;
      for (int j = 0; j <= i; ++j) {
        if (row.h[i] != 0) f[j] += row.h[i] * S[i][j];
        sum += S[i][j] * S[i][j];
      }
      size[i] = sqrtq(sum);
    }
    Quad innovation = row.y;
    for (int i = 0; i < n; ++i) innovation -= row.h[i] * x[i];
    Quad head = sqrtq(row.r);
    for (int j = n - 1; j >= 0; --j) {  // rotate f_j into the head; the gain fills from the last row up
      if (f[j] == 0) continue;
      const Quad length = sqrtq(head * head + f[j] * f[j]);
      const Quad c = head / length, s = f[j] / length;
      head = length;
      for (int i = j; i < n; ++i) {
        const Quad g = gain[i], column = S[i][j];
        gain[i] = c * g + s * column;
        S[i][j] = c * column - s * g;
      }
    }
    innovation /= head;
    for (int i = 0; i < n; ++i) x[i] += gain[i] * innovation;
    if (share > 0) widen(share);
  }

  /// P += share · diag(size²).
  void widen(Quad share) {
    std::array<Quad, most_states * 2 * most_states> a{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) a[i * 2 * n + j] = S[i][j];
      a[i * 2 * n + n + i] = sqrtq(share) * size[i];
    }
    make_lower(a.data(), n, 2 * n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) S[i][j] = a[i * 2 * n + j];
    }
  }

  void set_sizes() {
    for (int i = 0; i < n; ++i) {
      Quad sum = 0;
      for (int j = 0; j <= i; ++j) sum += S[i][j] * S[i][j];
      size[i] = sqrtq(sum);
    }
  }

  [[nodiscard]] QuadMatrix P() const {
    QuadMatrix out{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        Quad sum = 0;
        for (int k = 0; k <= j; ++k) sum += S[i][k] * S[j][k];
        out[i][j] = out[j][i] = sum;
      }
    }
    return out;
  }
  [[nodiscard]] bool known(int i) const {
    for (int j = 0; j <= i; ++j) {
      if (S[i][j] != 0) return false;
    }
    return true;
  }
};

/// Triangular root of the rows of S that are not zero: C (m×m) of the states `index`.
struct Triangle {
  int m = 0;
  std::array<int, most_states> index{};
  QuadMatrix C{};
  QuadVector inverse{};  // 1/C_ii

  explicit Triangle(const Moments& of) {
    for (int i = 0; i < of.n; ++i) {
      if (!of.known(i)) index[m++] = i;
    }
    if (m == of.n) {
      C = of.S;
    } else {
      std::array<Quad, most_states * most_states> a{};
      for (int i = 0; i < m; ++i) {
        for (int j = 0; j < of.n; ++j) a[i * of.n + j] = of.S[index[i]][j];
      }
      make_lower(a.data(), m, of.n);
      for (int i = 0; i < m; ++i) {
        for (int j = 0; j <= i; ++j) C[i][j] = a[i * of.n + j];
      }
    }
    for (int i = 0; i < m; ++i) inverse[i] = 1 / C[i][i];  // infinite in a singular one
  }

  /// C⁻¹ b, in place.
  void solve(QuadVector& b) const {
    for (int i = 0; i < m; ++i) {
      Quad sum = b[i];
      for (int k = 0; k < i; ++k) sum -= C[i][k] * b[k];
      b[i] = sum * inverse[i];
    }
  }
};

/// Condition of P in units of its states' own terms: max P_ii (P⁻¹)_ii; and with what cancelled in the last step,
/// max size_i² (P⁻¹)_ii. Infinite where P is singular to the judge; states with variance zero do not count.
struct Condition {
  double of_P = 1, of_step = 1;
};
inline Condition condition_of(const Moments& moments) {
  const Triangle root(moments);
  const int m = root.m;
  std::array<std::array<double, most_states>, most_states> unit{}, inverse{};
  std::array<double, most_states> sd{};
  for (int i = 0; i < m; ++i) {  // of the correlations; double will do for a label
    Quad sum = 0;
    for (int j = 0; j <= i; ++j) sum += root.C[i][j] * root.C[i][j];
    const Quad deviation = sqrtq(sum);
    sd[i] = static_cast<double>(deviation);
    for (int j = 0; j <= i; ++j) unit[i][j] = static_cast<double>(root.C[i][j] / deviation);
    if (!(std::abs(unit[i][i]) > 1e-30)) return {infinite, infinite};
  }
  for (int j = 0; j < m; ++j) {
    for (int i = j; i < m; ++i) {
      double sum = i == j ? 1 : 0;
      for (int k = j; k < i; ++k) sum -= unit[i][k] * inverse[k][j];
      inverse[i][j] = sum / unit[i][i];
    }
  }
  Condition out;
  for (int j = 0; j < m; ++j) {
    double sum = 0;
    for (int i = j; i < m; ++i) sum += inverse[i][j] * inverse[i][j];
    const double ratio = static_cast<double>(moments.size[root.index[j]]) / sd[j];
    out.of_P = std::max(out.of_P, sum);
    out.of_step = std::max(out.of_step, sum * std::max(1.0, ratio * ratio));
  }
  return out;
}

/// The largest |eigenvalue| of a symmetric m×m matrix, by Jacobi's rotations.
inline double spectral_norm(std::array<std::array<double, most_states>, most_states> a, int m) {
  for (int sweep = 0; sweep < 12; ++sweep) {
    double off = 0, all = 0;
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < m; ++j) {
        all += a[i][j] * a[i][j];
        if (i != j) off += a[i][j] * a[i][j];
      }
    }
    if (!(off > 1e-24 * all)) break;
    for (int p = 0; p < m; ++p) {
      for (int q = p + 1; q < m; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(1 + theta * theta));
        const double c = 1 / std::sqrt(1 + t * t), s = t * c;
        for (int k = 0; k < m; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y;
          a[k][q] = s * x + c * y;
        }
        for (int k = 0; k < m; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y;
          a[q][k] = s * x + c * y;
        }
      }
    }
  }
  double most = 0;
  for (int i = 0; i < m; ++i) most = std::max(most, std::abs(a[i][i]));
  return most;
}

/// The least e with |vᵀ (given - P) v| ≤ e vᵀ C Cᵀ v for all v, C Cᵀ being P or the wider matrix that it is compared
/// in. Infinite where `given` is not symmetric to the last bit, or holds a NaN.
inline double covariance_error(const QuadMatrix& given, const QuadMatrix& P, const Moments& wide) {
  const Triangle root(wide);
  const int n = wide.n, m = root.m;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) {
      if (!(given[i][j] == given[j][i])) return infinite;
    }
    if (!wide.known(i)) continue;
    for (int j = 0; j < n; ++j) {
      if (!(given[i][j] - P[i][j] == 0)) return infinite;
    }
  }
  QuadMatrix Y{};  // row j: C⁻¹ of column j of the difference
  for (int j = 0; j < m; ++j) {
    bool any = false;
    for (int i = 0; i < m; ++i) {
      Y[j][i] = given[root.index[i]][root.index[j]] - P[root.index[i]][root.index[j]];
      any = any || Y[j][i] != 0;
    }
    if (any) root.solve(Y[j]);
  }
  std::array<std::array<double, most_states>, most_states> E{};
  double sum = 0;
  for (int i = 0; i < m; ++i) {
    QuadVector z{};
    for (int j = 0; j < m; ++j) z[j] = Y[j][i];
    for (int j = 0; j <= i; ++j) {
      for (int k = 0; k < j; ++k) z[j] -= root.C[j][k] * z[k];
      z[j] *= root.inverse[j];
      E[i][j] = E[j][i] = static_cast<double>(z[j]);
      sum += (i == j ? 1 : 2) * E[i][j] * E[i][j];
    }
  }
  if (!std::isfinite(sum)) return infinite;
  return sum < 1e-20 ? std::sqrt(sum) : spectral_norm(E, m);
}

/// The least e for which given - x is the sum of a part within e standard deviations of P and of one of at most
/// `slack` e / bound per component. An upper bound of it where that is below `bound`.
inline double state_error(const QuadVector& given, const Moments& exact, double slack, double bound) {
  const int n = exact.n;
  QuadVector d{};
  double largest = 0;
  for (int i = 0; i < n; ++i) {
    d[i] = given[i] - exact.x[i];
    largest = std::max(largest, static_cast<double>(fabsq(d[i])));
    if (!(fabsq(d[i]) <= std::numeric_limits<double>::max())) return infinite;
  }
  if (largest == 0) return 0;
  const double coarse = slack > 0 ? bound * largest / slack * std::sqrt(double(n)) : infinite;
  if (coarse <= bound) return coarse;
  std::array<Quad, most_states * 2 * most_states> a{};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) a[i * 2 * n + j] = exact.S[i][j];
    a[i * 2 * n + n + i] = slack / bound;
  }
  make_lower(a.data(), n, 2 * n);
  Quad sum = 0;
  for (int i = 0; i < n; ++i) {
    Quad z = d[i];
    for (int k = 0; k < i; ++k) z -= a[i * 2 * n + k] * d[k];
    const Quad pivot = a[i * 2 * n + i];
    d[i] = z == 0 ? z : z / pivot;
    sum += d[i] * d[i];
  }
  const auto out = static_cast<double>(sqrtq(sum));
  return out >= 0 ? out : infinite;
}

/// What measurements say of x as n rows M x = z + v, cov v = I.
struct Information {
  using Rows = std::array<std::array<Quad, most_states + 1>, most_states>;
  int n = 0;
  Rows M{};  // upper triangular; z in column n

  /// Another row, whose variance is one.
  void add(std::array<Quad, most_states + 1> row) {
    for (int j = 0; j < n; ++j) {
      if (row[j] == 0) continue;
      const Quad length = sqrtq(M[j][j] * M[j][j] + row[j] * row[j]);
      const Quad c = M[j][j] / length, s = row[j] / length;
      for (int k = j; k <= n; ++k) {
        const Quad x = M[j][k], y = row[k];
        M[j][k] = c * x + s * y;
        row[k] = c * y - s * x;
      }
    }
  }
  void add(const ExactRow& row) {
    std::array<Quad, most_states + 1> scaled{};
    const Quad sd = sqrtq(row.r);
    for (int j = 0; j < n; ++j) scaled[j] = row.h[j] / sd;
    scaled[n] = row.y / sd;
    add(scaled);
  }
  /// From x + d w to x, w a vector of n independent variables of variance one.
  void widen(const QuadVector& d) {
    QuadMatrix B{};
    for (int i = 0; i < n; ++i) B[i][i] = d[i];
    forget(B);
    collect(M);
  }
  /// From x⁺ = F x + B w to x.
  void pass(const double* F, const QuadMatrix& B) {
    forget(B);
    Rows rows{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) rows[i][j] += M[i][k] * F[k * n + j];
      }
      rows[i][n] = M[i][n];
    }
    collect(rows);
  }

 private:
  void collect(const Rows& rows) {
    M = {};
    for (int i = 0; i < n; ++i) add(rows[i]);
  }
  /// From x + B w to x: each w_j is known to a standard deviation of one and is eliminated by a reflection of its own
  /// row and all of M.
  void forget(const QuadMatrix& B) {
    std::array<std::array<Quad, most_states>, most_states> MB{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) MB[i][j] += M[i][k] * B[k][j];
      }
    }
    for (int j = 0; j < n; ++j) {
      Quad sum = 0;
      QuadVector m{};
      for (int i = 0; i < n; ++i) {
        m[i] = MB[i][j];
        sum += m[i] * m[i];
      }
      if (sum == 0) continue;
      const Quad norm = sqrtq(1 + sum), factor = 1 / (norm * (norm + 1));  // v = (1 + norm, m)
      const auto reflect = [&](auto& table, int column) {
        Quad dot = 0;
        for (int i = 0; i < n; ++i) dot += m[i] * table[i][column];
        dot *= factor;
        for (int i = 0; i < n; ++i) table[i][column] -= dot * m[i];
      };
      for (int k = j + 1; k < n; ++k) reflect(MB, k);
      for (int k = 0; k <= n; ++k) reflect(M, k);
    }
  }
};

}  // namespace rounding
