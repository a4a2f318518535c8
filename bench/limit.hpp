// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a filter step costs when somebody writes it by hand for one size: plain loops, nothing checked,
/// nothing reported. The yardstick of the step benchmarks; the model's functions are the same ones.
#pragma once

#include <cmath>
#include <jml/estimate.hpp>

namespace limit {

template <int n>
using Square = double[n][n];

/// N = A P Aᵀ + Q, lower triangle, mirrored.
template <int n>
inline void propagate_symmetric(const Square<n>& A, const Square<n>& P, const Square<n>& Q, Square<n>& N) {
  Square<n> AP;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) AP[i][j] = 0;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) AP[i][j] += A[i][k] * P[k][j];
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = Q[i][j];
      for (int k = 0; k < n; ++k) sum += AP[i][k] * A[j][k];
      N[i][j] = N[j][i] = sum;
    }
  }
}

/// N = A P Bᵀ + Q.
template <int n>
inline void propagate(const Square<n>& A, const Square<n>& B, const Square<n>& P, const Square<n>& Q,
                      Square<n>& N) {
  Square<n> AP, BT;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) BT[i][j] = B[j][i];
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) AP[i][j] = 0;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) AP[i][j] += A[i][k] * P[k][j];
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) N[i][j] = Q[i][j];
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) N[i][j] += AP[i][k] * BT[k][j];
    }
  }
}

/// x += K r, P = N - K (H N) with S = H N Hᵀ + R, by Cholesky; lower triangle, mirrored.
template <int n, int p>
inline void correct_symmetric(const double (&H)[p][n], const Square<p>& R, const double (&r)[p],
                              const Square<n>& N, double (&x)[n], Square<n>& P) {
  double HN[p][n], S[p][p], inverse[p];
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < n; ++j) HN[i][j] = 0;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) HN[i][j] += H[i][k] * N[k][j];
    }
  }
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = R[i][j];
      for (int k = 0; k < n; ++k) sum += HN[i][k] * H[j][k];
      S[i][j] = sum;
    }
  }
  if constexpr (p == 1) {
    inverse[0] = 1 / S[0][0];
    for (int i = 0; i < n; ++i) {
      const double gain = HN[0][i] * inverse[0];
      x[i] += gain * r[0];
      for (int j = 0; j <= i; ++j) P[i][j] = P[j][i] = N[i][j] - gain * HN[0][j];
    }
    return;
  }
  for (int k = 0; k < p; ++k) {
    for (int j = 0; j < k; ++j) S[k][k] -= S[k][j] * S[k][j];
    S[k][k] = std::sqrt(S[k][k]);
    inverse[k] = 1 / S[k][k];
    for (int i = k + 1; i < p; ++i) {
      for (int j = 0; j < k; ++j) S[i][k] -= S[i][j] * S[k][j];
      S[i][k] *= inverse[k];
    }
  }
  double z[p];  // L⁻¹ r; and HN becomes V = L⁻¹ H N: K r = Vᵀ z, K S Kᵀ = Vᵀ V
  for (int i = 0; i < p; ++i) {
    z[i] = r[i];
    for (int k = 0; k < i; ++k) {
      z[i] -= S[i][k] * z[k];
      for (int j = 0; j < n; ++j) HN[i][j] -= S[i][k] * HN[k][j];
    }
    z[i] *= inverse[i];
    for (int j = 0; j < n; ++j) HN[i][j] *= inverse[i];
  }
  for (int k = 0; k < p; ++k) {
    for (int i = 0; i < n; ++i) x[i] += HN[k][i] * z[k];
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = N[i][j];
      for (int k = 0; k < p; ++k) sum -= HN[k][i] * HN[k][j];
      P[i][j] = P[j][i] = sum;
    }
  }
}

/// x += K r, P = N - K M N with S = M N mᵀ + R, K = N mᵀ S⁻¹, by LU with row exchanges.
template <int n, int p>
inline void correct(const double (&m)[p][n], const double (&M)[p][n], const Square<p>& R,
                    const double (&r)[p], const Square<n>& N, double (&x)[n], Square<n>& P) {
  double MN[p][n], NT[p][n], S[p][p];  // NT = (N mᵀ)ᵀ
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < n; ++j) MN[i][j] = 0;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) MN[i][j] += M[i][k] * N[k][j];
    }
    for (int j = 0; j < n; ++j) {
      double sum = 0;
      for (int k = 0; k < n; ++k) sum += N[j][k] * m[i][k];
      NT[i][j] = sum;
    }
  }
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < p; ++j) {
      double sum = R[i][j];
      for (int k = 0; k < n; ++k) sum += MN[i][k] * m[j][k];
      S[j][i] = sum;  // transposed: Sᵀ Kᵀ = (N mᵀ)ᵀ
    }
  }
  for (int k = 0; k < p; ++k) {
    int best = k;
    for (int i = k + 1; i < p; ++i) {
      if (std::fabs(S[i][k]) > std::fabs(S[best][k])) best = i;
    }
    if (best != k) {
      for (int j = 0; j < p; ++j) {
        const double t = S[k][j];
        S[k][j] = S[best][j];
        S[best][j] = t;
      }
      for (int j = 0; j < n; ++j) {
        const double t = NT[k][j];
        NT[k][j] = NT[best][j];
        NT[best][j] = t;
      }
    }
    const double inverse = 1 / S[k][k];
    for (int i = k + 1; i < p; ++i) {
      const double factor = S[i][k] * inverse;
      for (int j = k + 1; j < p; ++j) S[i][j] -= factor * S[k][j];
      for (int j = 0; j < n; ++j) NT[i][j] -= factor * NT[k][j];
    }
    S[k][k] = inverse;
  }
  for (int i = p - 1; i >= 0; --i) {  // NT becomes Kᵀ
    for (int k = i + 1; k < p; ++k) {
      for (int j = 0; j < n; ++j) NT[i][j] -= S[i][k] * NT[k][j];
    }
    for (int j = 0; j < n; ++j) NT[i][j] *= S[i][i];
  }
  for (int k = 0; k < p; ++k) {
    for (int i = 0; i < n; ++i) x[i] += NT[k][i] * r[k];
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) P[i][j] = N[i][j];
    for (int k = 0; k < p; ++k) {
      for (int j = 0; j < n; ++j) P[i][j] -= NT[k][i] * MN[k][j];
    }
  }
}

template <int rows, int cols>
inline void copy(const jml::Matrix<double, rows, cols>& from, double (&to)[rows][cols]) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) to[i][j] = from(i, j);
  }
}

/// A hand-made filter's state.
template <int n>
struct State {
  double x[n];
  Square<n> P;
};

/// One EKF step by hand; `noise` is G Q Gᵀ, formed once.
template <int n, int p, typename D, typename S>
inline void ekf_step(const D& d, const S& s, const Square<n>& noise, const Square<p>& R,
                     const jml::Vector<double, p>& y, State<n>& state) {
  const jml::Vector<double, n> prior = Eigen::Map<const jml::Vector<double, n>>(state.x);
  double A[n][n], H[p][n], r[p];
  Square<n> N;
  copy(jml::Matrix<double, n, n>(d.dynamics_jacobian(prior)), A);
  const jml::Vector<double, n> x = d.dynamics(prior);
  propagate_symmetric<n>(A, state.P, noise, N);
  copy(jml::Matrix<double, p, n>(s.measurement_jacobian(x)), H);
  const jml::Vector<double, p> predicted = s.measurement(x);
  for (int i = 0; i < p; ++i) r[i] = y(i) - predicted(i);
  for (int i = 0; i < n; ++i) state.x[i] = x(i);
  correct_symmetric<n, p>(H, R, r, N, state.x, state.P);
}

/// One step of the non-iterative JML filter, eq. (14), by hand.
template <int n, int p, typename D, typename S>
inline void jml_step(const D& d, const S& s, const Square<n>& noise, const Square<p>& R,
                     const jml::Vector<double, p>& y, State<n>& state) {
  const jml::Vector<double, n> prior = Eigen::Map<const jml::Vector<double, n>>(state.x);
  double A[n][n], B[n][n], m[p][n], M[p][n], r[p];
  Square<n> N;
  copy(jml::Matrix<double, n, n>(d.dynamics_sdc(prior)), A);
  copy(jml::Matrix<double, n, n>(d.dynamics_jacobian(prior)), B);
  const jml::Vector<double, n> x = d.dynamics(prior);
  propagate<n>(A, B, state.P, noise, N);
  copy(jml::Matrix<double, p, n>(s.measurement_jacobian(x)), m);
  copy(jml::Matrix<double, p, n>(s.measurement_sdc(x)), M);
  const jml::Vector<double, p> predicted = s.measurement(x);
  for (int i = 0; i < p; ++i) r[i] = y(i) - predicted(i);
  for (int i = 0; i < n; ++i) state.x[i] = x(i);
  correct<n, p>(m, M, R, r, N, state.x, state.P);
}

}  // namespace limit
