// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an exact JML step costs when somebody writes it by hand for one size: the sweeps of the library,
/// Gauss-Newton on (11) accelerated by Anderson's method of depth 2, in plain loops until the two lines hold,
/// and N, K and P once at the root. Nothing else is checked and nothing reported: no minimum asked for, no
/// digits counted, no way out. R⁻¹ is given.
#pragma once

#include <algorithm>
#include <limits>

#include "limit.hpp"

namespace limit {

/// One step; the sweeps taken, or -1 where it did not converge. `noise` is G Q Gᵀ; F(d, x, x̂) and M(s, x, x̄)
/// give the SDC matrices of P.
template <int n, int p, typename D, typename S, typename F, typename M>
inline int iterated_step(const D& d, const S& s, const Square<n>& noise, const Square<p>& R,
                         const Square<p>& R_inverse, const jml::Vector<double, p>& y, double tolerance,
                         const F& dynamics_sdc, const M& measurement_sdc, State<n>& state) {
  using X = jml::Vector<double, n>;
  const X prior = Eigen::Map<const X>(state.x), prediction = d.dynamics(prior);
  const Square<n>& P = state.P;
  double x[2 * n], unit[2 * n], g[2 * n], r[2 * n], last_r[2 * n], last_g[2 * n], dr[2][2 * n], dg[2][2 * n];
  for (int i = 0; i < n; ++i) {
    x[i] = prior(i);
    x[n + i] = prediction(i);
    unit[i] = unit[n + i] =
        1 / (std::fabs(prior(i)) + std::fabs(prediction(i)) + std::sqrt(P[i][i] + noise[i][i]));
  }
  double A[n][n], H[p][n], fm[n][p], Pfm[n][p], Cm[n][p], innovation[p], weighted[p];
  X x_s, x_1;
  for (int sweep = 0;; ++sweep) {
    for (int i = 0; i < n; ++i) {
      x_s(i) = x[i];
      x_1(i) = x[n + i];
    }
    copy(jml::Matrix<double, n, n>(d.dynamics_jacobian(x_s)), A);
    copy(jml::Matrix<double, p, n>(s.measurement_jacobian(x_1)), H);
    const X f = d.dynamics(x_s);
    const jml::Vector<double, p> m = s.measurement(x_1);
    for (int k = 0; k < p; ++k) innovation[k] = y(k) - m(k);
    for (int k = 0; k < p; ++k) {
      weighted[k] = 0;
      for (int l = 0; l < p; ++l) weighted[k] += R_inverse[k][l] * innovation[l];
    }
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < p; ++k) {
        fm[i][k] = Cm[i][k] = 0;
        for (int j = 0; j < n; ++j) {
          fm[i][k] += A[j][i] * H[k][j];
          Cm[i][k] += noise[i][j] * H[k][j];
        }
      }
    }
    double largest = 0;
    for (int i = 0; i < n; ++i) {
      double first = prior(i) - x_s(i), second = f(i) - x_1(i);
      for (int k = 0; k < p; ++k) {
        Pfm[i][k] = 0;
        for (int j = 0; j < n; ++j) Pfm[i][k] += P[i][j] * fm[j][k];
        first += Pfm[i][k] * weighted[k];
        second += Cm[i][k] * weighted[k];
      }
      largest = std::max({largest, std::fabs(first) * unit[i], std::fabs(second) * unit[i]});
    }
    if (largest <= tolerance) {
      double B[n][n], slot_m[p][n], rest[p];
      Square<n> N;
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) B[i][j] = A[i][j];
        state.x[i] = x_1(i);
      }
      for (int k = 0; k < p; ++k) rest[k] = 0;
      copy(dynamics_sdc(d, x_s, prior), A);
      copy(measurement_sdc(s, x_1, prediction), slot_m);
      propagate<n>(A, B, state.P, noise, N);
      correct<n, p>(H, slot_m, R, rest, N, state.x, state.P);
      return sweep;
    }
    if (sweep == 40 || !(largest < std::numeric_limits<double>::infinity())) return -1;

    double bar[n], Nm[n][p], St[p][p], delta[p];  // St: Sᵀ by columns, rows exchanged
    for (int i = 0; i < n; ++i) {
      bar[i] = f(i);
      for (int k = 0; k < p; ++k) Nm[i][k] = Cm[i][k];
      for (int j = 0; j < n; ++j) {
        bar[i] += A[i][j] * (prior(j) - x_s(j));
        for (int k = 0; k < p; ++k) Nm[i][k] += A[i][j] * Pfm[j][k];
      }
    }
    for (int k = 0; k < p; ++k) {
      delta[k] = innovation[k];
      for (int j = 0; j < n; ++j) delta[k] -= H[k][j] * (bar[j] - x_1(j));
      for (int l = 0; l < p; ++l) {
        St[k][l] = R[k][l];
        for (int j = 0; j < n; ++j) St[k][l] += H[k][j] * Nm[j][l];
      }
    }
    for (int k = 0; k < p; ++k) {
      int best = k;
      for (int i = k + 1; i < p; ++i) {
        if (std::fabs(St[i][k]) > std::fabs(St[best][k])) best = i;
      }
      if (best != k) {
        std::swap_ranges(St[k], St[k] + p, St[best]);
        std::swap(delta[k], delta[best]);
      }
      St[k][k] = 1 / St[k][k];
      for (int i = k + 1; i < p; ++i) {
        const double factor = St[i][k] * St[k][k];
        for (int j = k + 1; j < p; ++j) St[i][j] -= factor * St[k][j];
        delta[i] -= factor * delta[k];
      }
    }
    for (int i = p - 1; i >= 0; --i) {
      for (int k = i + 1; k < p; ++k) delta[i] -= St[i][k] * delta[k];
      delta[i] *= St[i][i];
    }
    for (int i = 0; i < n; ++i) {
      g[i] = prior(i);
      g[n + i] = bar[i];
      for (int k = 0; k < p; ++k) {
        g[i] += Pfm[i][k] * delta[k];
        g[n + i] += Nm[i][k] * delta[k];
      }
    }

    double a11 = 0, a12 = 0, a22 = 0, b1 = 0, b2 = 0, newer = 0, older = 0;
    for (int i = 0; i < 2 * n; ++i) {
      r[i] = unit[i] * (g[i] - x[i]);
      if (sweep > 1) {
        dr[1][i] = dr[0][i];
        dg[1][i] = dg[0][i];
      }
      if (sweep > 0) {
        dr[0][i] = r[i] - last_r[i];
        dg[0][i] = g[i] - last_g[i];
        a11 += dr[0][i] * dr[0][i];
        b1 += dr[0][i] * r[i];
      }
      if (sweep > 1) {
        a12 += dr[0][i] * dr[1][i];
        a22 += dr[1][i] * dr[1][i];
        b2 += dr[1][i] * r[i];
      }
      last_r[i] = r[i];
      last_g[i] = g[i];
      x[i] = g[i];
    }
    const double determinant = a11 * a22 - a12 * a12;
    if (determinant > 64 * std::numeric_limits<double>::epsilon() * a11 * a22) {
      newer = (b1 * a22 - b2 * a12) / determinant;
      older = (b2 * a11 - b1 * a12) / determinant;
      for (int i = 0; i < 2 * n; ++i) x[i] -= dg[0][i] * newer + dg[1][i] * older;
    } else if (a11 > 0) {
      newer = b1 / a11;
      for (int i = 0; i < 2 * n; ++i) x[i] -= dg[0][i] * newer;
    }
  }
}

}  // namespace limit
