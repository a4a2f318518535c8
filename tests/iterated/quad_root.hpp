// SPDX-License-Identifier: BSD-3-Clause
// The root of one exact step in 113-bit arithmetic, by Newton on the stationarity equations, and P there. Models
//   f(x) = F x + c sin(a·x) b,   m_k(x) = g(h_k·x)
// have first and second derivatives by hand. What a filter is told of them is their doubles, and where P is near
// singular a rounding of f_x or m_x moves it: near the point of interest the models of the oracle are therefore
//   f(x) + δf + δA (x - x_0),   m(x) + δm + δH (x - x_0)
// with the differences between the doubles and the exact values at x_0.
#pragma once

#include <quadmath.h>

#include <array>
#include <cmath>
#include <jml/model/functions.hpp>

namespace quad_root {

__extension__ typedef __float128 Quad;

template <int rows, int cols>
using Table = std::array<std::array<Quad, cols>, rows>;
template <int n>
using Column = std::array<Quad, n>;

enum class Shape { line, wave, saturation, range };

/// g, g', g'' at u.
inline std::array<Quad, 3> shape(Shape kind, Quad u) {
  if (kind == Shape::line) return {u, 1, 0};
  if (kind == Shape::wave) return {u + sinq(u) / 4, 1 + cosq(u) / 4, -sinq(u) / 4};
  const Quad s = sqrtq(1 + u * u);
  if (kind == Shape::saturation) return {u / s, 1 / (s * s * s), -3 * u / (s * s * s * s * s)};
  return {s, u / s, 1 / (s * s * s)};
}

template <int n>
struct Motion {
  static constexpr int states = n, disturbances = n;
  std::array<double, n * n> F{};
  std::array<double, n> a{}, b{}, q{};
  double c = 0;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    using std::sin;
    T phase = a[0] * x(0);
    for (int i = 1; i < n; ++i) phase = phase + a[i] * x(i);
    jml::Vector<T, n> out;
    for (int i = 0; i < n; ++i) {
      out(i) = c * b[i] * sin(phase);
      for (int j = 0; j < n; ++j) out(i) = out(i) + F[i * n + j] * x(j);
    }
    return out;
  }
  jml::Matrix<double, n, n> disturbance_covariance() const {
    jml::Matrix<double, n, n> Q = jml::Matrix<double, n, n>::Zero();
    for (int i = 0; i < n; ++i) Q(i, i) = q[i];
    return Q;
  }
};

template <int n, int p>
struct Rows {
  static constexpr int measurements = p;
  std::array<double, p * n> h{};
  std::array<double, p> r{};
  Shape kind = Shape::line;

  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    using std::sin;
    using std::sqrt;
    jml::Vector<T, p> out;
    for (int k = 0; k < p; ++k) {
      T u = h[k * n] * x(0);
      for (int j = 1; j < n; ++j) u = u + h[k * n + j] * x(j);
      if (kind == Shape::line) out(k) = u;
      if (kind == Shape::wave) out(k) = u + 0.25 * sin(u);
      if (kind == Shape::saturation) out(k) = u / sqrt(1.0 + u * u);
      if (kind == Shape::range) out(k) = sqrt(1.0 + u * u);
    }
    return out;
  }
  jml::Matrix<double, p, p> noise_covariance() const {
    jml::Matrix<double, p, p> R = jml::Matrix<double, p, p>::Zero();
    for (int k = 0; k < p; ++k) R(k, k) = r[k];
    return R;
  }
  Quad along(int k, const Column<n>& x) const {
    Quad sum = 0;
    for (int j = 0; j < n; ++j) sum += h[k * n + j] * x[j];
    return sum;
  }
};

/// a ← a⁻¹ b by elimination with row exchanges.
template <int m, int c>
inline bool solve(Table<m, m> a, Table<m, c>& b) {
  for (int k = 0; k < m; ++k) {
    int best = k;
    for (int i = k + 1; i < m; ++i) {
      if (fabsq(a[i][k]) > fabsq(a[best][k])) best = i;
    }
    if (a[best][k] == 0) return false;
    std::swap(a[k], a[best]);
    std::swap(b[k], b[best]);
    for (int i = k + 1; i < m; ++i) {
      const Quad factor = a[i][k] / a[k][k];
      for (int j = k; j < m; ++j) a[i][j] -= factor * a[k][j];
      for (int j = 0; j < c; ++j) b[i][j] -= factor * b[k][j];
    }
  }
  for (int k = m - 1; k >= 0; --k) {
    for (int j = 0; j < c; ++j) {
      for (int l = k + 1; l < m; ++l) b[k][j] -= a[k][l] * b[l][j];
      b[k][j] /= a[k][k];
    }
  }
  return true;
}

/// L L^T = a; false where a is not positive definite.
template <int n>
inline bool cholesky(const Table<n, n>& a, Table<n, n>& L) {
  L = {};
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      Quad sum = a[i][j];
      for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      if (i == j) {
        if (!(sum > 0)) return false;
        L[j][j] = sqrtq(sum);
      } else {
        L[i][j] = sum / L[j][j];
      }
    }
  }
  return true;
}
template <int n>
inline Column<n> forward(const Table<n, n>& L, Column<n> v) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) v[i] -= L[i][k] * v[k];
    v[i] /= L[i][i];
  }
  return v;
}

/// The step from x̂, P (of the estimate before; `moves` false: a correction alone).
template <int n, int p>
struct Step {
  const Motion<n>& motion;
  const Rows<n, p>& rows;
  Column<n> x_hat;
  Table<n, n> P;
  Column<p> y;
  /// none: a correction; before: predicted once, linearised at x̂; joint: the exact step.
  enum class Kind { none, before, joint } kind = Kind::none;
  Column<n> at_f{}, at_m{}, f_off{};  // x_0 of f and of m, δf
  Table<n, n> A_off{};
  Column<p> m_off{};
  Table<p, n> H_off{};

  /// Both models as doubles say them at x_s and x.
  void anchor(const jml::Vector<double, n>& x_s, const jml::Vector<double, n>& x) {
    const jml::StepContext<double> none{};
    for (int i = 0; i < n; ++i) {
      at_f[i] = x_s(i);
      at_m[i] = x(i);
    }
    f_off = {};
    A_off = {};
    m_off = {};
    H_off = {};
    const auto f_double = jml::dynamics(motion, x_s, none);
    const auto A_double = jml::dynamics_jacobian(motion, x_s, none);
    const auto m_double = jml::measurement(rows, x, none);
    const auto H_double = jml::measurement_jacobian(rows, x, none);
    const Column<n> f_exact = f(at_f);
    const Table<n, n> A_exact = f_x(at_f);
    const Column<p> m_exact = m(at_m);
    const Table<p, n> H_exact = m_x(at_m);
    for (int i = 0; i < n; ++i) {
      f_off[i] = f_double(i) - f_exact[i];
      for (int j = 0; j < n; ++j) A_off[i][j] = A_double(i, j) - A_exact[i][j];
    }
    for (int k = 0; k < p; ++k) {
      m_off[k] = m_double(k) - m_exact[k];
      for (int j = 0; j < n; ++j) H_off[k][j] = H_double(k, j) - H_exact[k][j];
    }
  }
  Column<p> m(const Column<n>& x) const {
    Column<p> out;
    for (int k = 0; k < p; ++k) {
      out[k] = shape(rows.kind, rows.along(k, x))[0] + m_off[k];
      for (int j = 0; j < n; ++j) out[k] += H_off[k][j] * (x[j] - at_m[j]);
    }
    return out;
  }
  Table<p, n> m_x(const Column<n>& x) const {
    Table<p, n> out;
    for (int k = 0; k < p; ++k) {
      for (int j = 0; j < n; ++j) out[k][j] = shape(rows.kind, rows.along(k, x))[1] * rows.h[k * n + j] + H_off[k][j];
    }
    return out;
  }
  Column<n> f(const Column<n>& x) const {
    Column<n> out{};
    for (int i = 0; i < n; ++i) {
      out[i] = motion.c * sinq(phase(x)) * motion.b[i] + f_off[i];
      for (int j = 0; j < n; ++j) out[i] += motion.F[i * n + j] * x[j] + A_off[i][j] * (x[j] - at_f[j]);
    }
    return out;
  }
  Table<n, n> f_x(const Column<n>& x) const {
    Table<n, n> out{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) out[i][j] = motion.F[i * n + j] + motion.c * cosq(phase(x)) * motion.b[i] * motion.a[j] + A_off[i][j];
    }
    return out;
  }
  Quad phase(const Column<n>& x) const {
    Quad sum = 0;
    for (int i = 0; i < n; ++i) sum += motion.a[i] * x[i];
    return sum;
  }

  /// A P A^T + Q.
  Table<n, n> moved(const Table<n, n>& A) const {
    Table<n, n> AP{}, N{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) AP[i][j] += A[i][k] * P[k][j];
      }
    }
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) N[i][j] += AP[i][k] * A[j][k];
      }
      N[i][i] += motion.q[i];
    }
    return N;
  }

  struct Answer {
    Column<n> x_s, x;
    Table<n, n> P;
    bool converged = false;
    Quad cost = 0, start_cost = 0;
  };

  /// Newton from (x_s, x).
  Answer find(Column<n> x_s, Column<n> x) const {
    Step local = *this;
    Column<n> bar = x_hat;
    if (kind == Kind::before) {
      bar = f(x_hat);
      local.P = moved(f_x(x_hat));
    }
    Answer out{x_s, x, {}};
    Quad before = -1;
    for (int k = 0; k < 60; ++k) {
      const Quad change = kind == Kind::joint ? newton_joint(out.x_s, out.x) : newton(bar, local.P, out.x);
      if (!(change >= 0)) return out;
      // quadratic until rounding ends it
      out.converged = change < Quad(1e-26) || (before >= 0 && before < Quad(1e-20) && change < Quad(1e-20));
      if (change < Quad(1e-28) || (out.converged && change >= before / 2)) break;
      before = change;
    }
    const Table<n, n> N = kind == Kind::joint ? moved(f_x(out.x_s)) : local.P;
    out.P = corrected(N, out.x);
    return out;
  }

 private:
  Column<p> weighted(const Column<n>& x) const {  // R^-1 (y - m)
    Column<p> nu = m(x);
    for (int k = 0; k < p; ++k) nu[k] = (y[k] - nu[k]) / rows.r[k];
    return nu;
  }
  Column<n> pull(const Column<n>& x) const {  // e = m_x^T R^-1 (y - m)
    Column<n> e{};
    const Column<p> nu = weighted(x);
    const Table<p, n> H = m_x(x);
    for (int k = 0; k < p; ++k) {
      for (int j = 0; j < n; ++j) e[j] += nu[k] * H[k][j];
    }
    return e;
  }
  Table<n, n> pull_slope(const Column<n>& x) const {  // ∂e/∂x
    Table<n, n> out{};
    const Column<p> nu = weighted(x);
    const Table<p, n> H = m_x(x);
    for (int k = 0; k < p; ++k) {
      const auto g = shape(rows.kind, rows.along(k, x));
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j)
          out[i][j] += nu[k] * g[2] * rows.h[k * n + i] * rows.h[k * n + j] - H[k][i] / rows.r[k] * H[k][j];
      }
    }
    return out;
  }
  /// x - x̄ - P e = 0; the largest change over the size of x.
  Quad newton(const Column<n>& bar, const Table<n, n>& N, Column<n>& x) const {
    Table<n, 1> r{};
    Table<n, n> J{};
    const Column<n> e = pull(x);
    const Table<n, n> slope = pull_slope(x);
    for (int i = 0; i < n; ++i) {
      r[i][0] = x[i] - bar[i];
      J[i][i] = 1;
      for (int k = 0; k < n; ++k) {
        r[i][0] -= N[i][k] * e[k];
        for (int j = 0; j < n; ++j) J[i][j] -= N[i][k] * slope[k][j];
      }
    }
    if (!solve<n, 1>(J, r)) return -1;
    Quad change = 0;
    for (int i = 0; i < n; ++i) {
      x[i] -= r[i][0];
      change = fmaxq(change, fabsq(r[i][0]) / (1 + fabsq(x[i])));
    }
    return change;
  }
  /// x_s - x̂ - P f_x^T e = 0, x - f(x_s) - C e = 0.
  Quad newton_joint(Column<n>& x_s, Column<n>& x) const {
    Table<2 * n, 1> r{};
    Table<2 * n, 2 * n> J{};
    const Column<n> e = pull(x), at = f(x_s);
    const Table<n, n> slope = pull_slope(x), A = f_x(x_s);
    Quad weight = 0;
    for (int i = 0; i < n; ++i) weight += motion.b[i] * e[i];
    for (int i = 0; i < n; ++i) {
      r[i][0] = x_s[i] - x_hat[i];
      r[n + i][0] = x[i] - at[i] - motion.q[i] * e[i];
      J[i][i] = J[n + i][n + i] = 1;
      for (int j = 0; j < n; ++j) {
        J[n + i][j] -= A[i][j];
        J[n + i][n + j] -= motion.q[i] * slope[i][j];
        for (int k = 0; k < n; ++k) {
          r[i][0] -= P[i][k] * A[j][k] * e[j];  // P f_x^T e
          J[i][j] += P[i][k] * motion.c * sinq(phase(x_s)) * weight * motion.a[k] * motion.a[j];
          for (int l = 0; l < n; ++l) J[i][n + j] -= P[i][k] * A[l][k] * slope[l][j];
        }
      }
    }
    if (!solve<2 * n, 1>(J, r)) return -1;
    Quad change = 0;
    for (int i = 0; i < n; ++i) {
      x_s[i] -= r[i][0];
      x[i] -= r[n + i][0];
      change = fmaxq(change, fmaxq(fabsq(r[i][0]) / (1 + fabsq(x_s[i])), fabsq(r[n + i][0]) / (1 + fabsq(x[i]))));
    }
    return change;
  }
  /// (I - k h) N (I - k h)^T + k r k^T, row by row.
  Table<n, n> corrected(Table<n, n> N, const Column<n>& x) const {
    const Table<p, n> H = m_x(x);
    for (int k = 0; k < p; ++k) {
      const Column<n>& h = H[k];
      Column<n> Nh{};
      Quad s = rows.r[k];
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) Nh[i] += N[i][j] * h[j];
      }
      for (int i = 0; i < n; ++i) s += h[i] * Nh[i];
      Table<n, n> I{}, IN{};  // I - k h, which loses nothing twice
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) I[i][j] = Quad(i == j) - Nh[i] / s * h[j];
      }
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          for (int l = 0; l < n; ++l) IN[i][j] += I[i][l] * N[l][j];
        }
      }
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          N[i][j] = Nh[i] / s * rows.r[k] * (Nh[j] / s);
          for (int l = 0; l < n; ++l) N[i][j] += IN[i][l] * I[j][l];
        }
      }
    }
    return N;
  }
};

/// √((x - x*)^T P*^-1 (x - x*)), and the largest |v^T (P - P*) v| / v^T P* v to a factor n; negative where P* is
/// not positive definite.
template <int n>
struct Distance {
  double x = -1, P = -1;
};
template <int n>
Distance<n> distance(const Column<n>& x, const Table<n, n>& P, const Column<n>& x_exact, const Table<n, n>& exact) {
  Distance<n> out;
  Table<n, n> L;
  if (!cholesky<n>(exact, L)) return out;
  Column<n> off;
  for (int i = 0; i < n; ++i) off[i] = x[i] - x_exact[i];
  off = forward<n>(L, off);
  Quad sum = 0;
  for (int i = 0; i < n; ++i) sum += off[i] * off[i];
  out.x = static_cast<double>(sqrtq(sum));
  Table<n, n> half{};  // L^-1 (P - P*), column by column
  for (int j = 0; j < n; ++j) {
    Column<n> column;
    for (int i = 0; i < n; ++i) column[i] = P[i][j] - exact[i][j];
    column = forward<n>(L, column);
    for (int i = 0; i < n; ++i) half[i][j] = column[i];
  }
  sum = 0;
  for (int i = 0; i < n; ++i) {
    const Column<n> row = forward<n>(L, half[i]);
    for (int j = 0; j < n; ++j) sum += row[j] * row[j];
  }
  out.P = static_cast<double>(sqrtq(sum));
  return out;
}

}  // namespace quad_root
