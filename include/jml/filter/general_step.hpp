// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One step of a nonsymmetric rule in twice the digits: N = A P Bᵀ + C, S = R + E N Dᵀ, K = N Dᵀ S⁻¹,
/// P⁺ = N - K E N (Rusnak 2015, eq. (14)), entry by entry, for a P that has no factors U D Uᵀ.
///
/// Sizes are run-time numbers and the memory is the caller's, as in filter/extended_step.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/matrix.hpp>
#include <jml/twofold.hpp>

namespace jml::detail {

/// Room for n states and p measurements.
template <typename Scalar, int n, int p>
struct GeneralMemory {
  using T = Extended<Scalar>;
  T P[n * n], N[n * n], work[n * n], ND[n * p], S[p * p], K[n * p], EN[p * n], x[n];
  int order[p];
};

template <typename Scalar>
class GeneralStep {
 public:
  using T = Extended<Scalar>;

  template <int n, int p>
  explicit GeneralStep(GeneralMemory<Scalar, n, p>& m)
      : n_(n),
        p_(p),
        P_(m.P),
        N_(m.N),
        work_(m.work),
        ND_(m.ND),
        S_(m.S),
        K_(m.K),
        EN_(m.EN),
        x_(m.x),
        order_(m.order) {}

  /// N = P.
  void load(const Scalar* P) {
    for (int i = 0; i < n_ * n_; ++i) N_[i] = T(P[i]);
  }
  /// N ← A N Bᵀ + C, all n×n.
  void move(const Scalar* A, const Scalar* B, const Scalar* C) {
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) {
        T sum(0);
        for (int k = 0; k < n_; ++k) sum = sum + T(A[i + k * n_]) * N_[k + j * n_];
        work_[i + j * n_] = sum;  // A P
      }
    }
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) {
        T sum(C[i + j * n_]);
        for (int k = 0; k < n_; ++k) sum = sum + work_[i + k * n_] * T(B[j + k * n_]);
        N_[i + j * n_] = sum;
      }
    }
  }
  /// x ← x̄ + K e and P⁺, with D, E p×n, R p×p. False where S is singular.
  [[nodiscard]] bool correct(const Scalar* D, const Scalar* E, const Scalar* R, const Scalar* x,
                             const Scalar* e) {
    for (int i = 0; i < n_; ++i) {
      for (int l = 0; l < p_; ++l) {
        T nd(0), en(0);
        for (int k = 0; k < n_; ++k) {
          nd = nd + N_[i + k * n_] * T(D[l + k * p_]);
          en = en + T(E[l + k * p_]) * N_[k + i * n_];
        }
        ND_[i + l * n_] = nd;  // N Dᵀ
        EN_[l + i * p_] = en;  // E N
      }
    }
    for (int i = 0; i < p_; ++i) {
      for (int l = 0; l < p_; ++l) {
        T sum(R[i + l * p_]);
        for (int k = 0; k < n_; ++k) sum = sum + T(E[i + k * p_]) * ND_[k + l * n_];
        S_[i + l * p_] = sum;  // S = R + E N Dᵀ
      }
    }
    if (!solve()) return false;
    for (int i = 0; i < n_; ++i) {
      x_[i] = T(x[i]);
      for (int l = 0; l < p_; ++l) x_[i] = x_[i] + K_[i + l * n_] * T(e[l]);  // x̄ + K e
      for (int j = 0; j < n_; ++j) {
        T sum = N_[i + j * n_];
        for (int l = 0; l < p_; ++l) sum = sum - K_[i + l * n_] * EN_[l + j * p_];
        P_[i + j * n_] = sum;  // N - K E N
      }
    }
    return true;
  }

  [[nodiscard]] Scalar x(int i) const { return in_two<Scalar>(x_[i]).high; }
  [[nodiscard]] Scalar P(int i, int j) const { return in_two<Scalar>(P_[i + j * n_]).high; }
  [[nodiscard]] Scalar N(int i, int j) const { return in_two<Scalar>(N_[i + j * n_]).high; }
  [[nodiscard]] Scalar K(int i, int l) const { return in_two<Scalar>(K_[i + l * n_]).high; }

 private:
  static Scalar size(const T& a) { return std::abs(in_two<Scalar>(a).high); }

  /// K = N Dᵀ S⁻¹ by Gauss elimination of the columns of S, the largest pivot of each row first.
  bool solve() {
    for (int i = 0; i < n_ * p_; ++i) K_[i] = ND_[i];
    for (int l = 0; l < p_; ++l) order_[l] = l;
    for (int k = 0; k < p_; ++k) {
      int best = k;
      Scalar row = 0;
      for (int l = 0; l < p_; ++l) {
        if (l >= k && size(S_[k + order_[l] * p_]) > size(S_[k + order_[best] * p_])) best = l;
        row += size(S_[k + order_[l] * p_]);
      }
      std::swap(order_[k], order_[best]);
      const int column = order_[k];
      const T pivot = S_[k + column * p_];
      if (!(size(pivot) > Scalar(64 * p_) * extended_epsilon<Scalar> * row)) return false;
      for (int i = 0; i < p_; ++i) {
        if (i != k) S_[i + column * p_] = S_[i + column * p_] / pivot;
      }
      for (int i = 0; i < n_; ++i) K_[i + column * n_] = K_[i + column * n_] / pivot;
      for (int l = 0; l < p_; ++l) {
        if (order_[l] == column) continue;
        const T factor = S_[k + order_[l] * p_];
        for (int i = 0; i < p_; ++i) {
          if (i != k) S_[i + order_[l] * p_] = S_[i + order_[l] * p_] - S_[i + column * p_] * factor;
        }
        for (int i = 0; i < n_; ++i)
          K_[i + order_[l] * n_] = K_[i + order_[l] * n_] - K_[i + column * n_] * factor;
        S_[k + order_[l] * p_] = T(0);
      }
      S_[k + column * p_] = T(1);
    }
    // Column order_[k] of K is now that of row k of S.
    for (int i = 0; i < n_; ++i) {
      for (int k = 0; k < p_; ++k) ND_[i + k * n_] = K_[i + order_[k] * n_];
    }
    for (int i = 0; i < n_ * p_; ++i) K_[i] = ND_[i];
    return true;
  }

  int n_, p_;
  T *P_, *N_, *work_, *ND_, *S_, *K_, *EN_, *x_;
  int* order_;
};

/// P⁺, N and K of a nonsymmetric rule from P by slots A, B, D, E, in twice the digits. False where S is
/// singular.
template <typename Scalar, int n, int p>
[[nodiscard]] JML_RARE bool general_riccati_in_two(
    const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& A, const Matrix<Scalar, n, n>& B,
    const Matrix<Scalar, n, n>& C, const Matrix<Scalar, p, n>& D, const Matrix<Scalar, p, n>& E,
    const Matrix<Scalar, p, p>& R, Matrix<Scalar, n, n>& N, Matrix<Scalar, n, n>& next,
    Matrix<Scalar, n, p>& gain) {
  GeneralMemory<Scalar, n, p> memory;
  GeneralStep<Scalar> two(memory);
  const Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();
  const Vector<Scalar, p> e = kernel::zeros<Vector<Scalar, p>>();
  two.load(P.data());
  two.move(A.data(), B.data(), C.data());
  if (!two.correct(D.data(), E.data(), R.data(), x.data(), e.data())) return false;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      next(i, j) = two.P(i, j);
      N(i, j) = two.N(i, j);
    }
    for (int l = 0; l < p; ++l) gain(i, l) = two.K(i, l);
  }
  return true;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
