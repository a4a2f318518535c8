// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The solution of an algebraic Riccati equation as it is stored, to 30 digits: Newton's method with Gaussian
/// elimination on vec(X), in quadruple precision. Shares nothing with the library.
#pragma once

#include <cmath>
#include <jml/riccati/algebraic.hpp>
#include <vector>

#include "riccati/algebraic_checks.hpp"

namespace algebraic {

using Quad = __float128;

inline Quad magnitude(Quad x) { return x < 0 ? -x : x; }

/// A x = b, row by row, with the largest pivot; b becomes x. False where A is singular.
inline bool eliminate(std::vector<std::vector<Quad>>& A, std::vector<Quad>& b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < n; ++i) {
      if (magnitude(A[i][k]) > magnitude(A[best][k])) best = i;
    }
    std::swap(A[k], A[best]);
    std::swap(b[k], b[best]);
    if (A[k][k] == 0) return false;
    for (std::size_t i = k + 1; i < n; ++i) {
      const Quad factor = A[i][k] / A[k][k];
      for (std::size_t j = k; j < n; ++j) A[i][j] -= factor * A[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= A[k][j] * b[j];
    b[k] /= A[k][k];
  }
  return true;
}

/// An equation and its unknown in quadruple precision.
template <int n1, int n2>
class TrueSolution {
 public:
  template <typename Scalar>
  TrueSolution(const jml::AlgebraicRiccati<Scalar, n1, n2>& e, const jml::Matrix<Scalar, n1, n2>& start) {
    read(e.A, e.signs.AX, A_);
    read(e.B, e.signs.XB, B_);
    read(e.Q, e.signs.Q, Q_);
    read(e.S, -e.signs.XSX, S_);
    read(start, 1, X_);
    for (int step = 0; step < 200 && !converged_; ++step) {
      if (!newton()) return;
    }
  }

  /// False where Newton's method found no root from the start.
  [[nodiscard]] bool converged() const { return converged_; }

  /// The root found is the stabilising one.
  [[nodiscard]] bool stabilizes() const {
    if (!converged_) return false;
    Long A(n1, n1), B(n2, n2), S(n2, n1), X(n1, n2);
    write(A_, A);
    write(B_, B);
    write(S_, S);
    write(X_, X);
    return is_stable(A - X * S) && is_stable(B - S * X);
  }

  /// ‖X - this‖/‖this‖
  template <typename Scalar>
  [[nodiscard]] double error_of(const jml::Matrix<Scalar, n1, n2>& X) const {
    long double error = 0, size = 0;
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        error = std::hypot(error, static_cast<long double>(Quad(X(i, j)) - X_[i][j]));
        size = std::hypot(size, static_cast<long double>(X_[i][j]));
      }
    }
    return static_cast<double>(error / size);
  }

 private:
  template <typename M, std::size_t rows, std::size_t cols>
  static void read(const M& m, int sign, Quad (&out)[rows][cols]) {
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < cols; ++j)
        out[i][j] = sign * Quad(m(static_cast<int>(i), static_cast<int>(j)));
    }
  }

  template <std::size_t rows, std::size_t cols>
  static void write(const Quad (&m)[rows][cols], Long& out) {
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < cols; ++j)
        out(static_cast<int>(i), static_cast<int>(j)) = static_cast<long double>(m[i][j]);
    }
  }

  // (A - X S) Z + Z (B - S X) = -(A X + X B + Q - X S X)
  bool newton() {
    Quad left[n1][n1], right[n2][n2];
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n1; ++j) {
        left[i][j] = A_[i][j];
        for (int k = 0; k < n2; ++k) left[i][j] -= X_[i][k] * S_[k][j];
      }
    }
    for (int i = 0; i < n2; ++i) {
      for (int j = 0; j < n2; ++j) {
        right[i][j] = B_[i][j];
        for (int k = 0; k < n1; ++k) right[i][j] -= S_[i][k] * X_[k][j];
      }
    }
    constexpr std::size_t m = n1 * n2;
    std::vector<std::vector<Quad>> L(m, std::vector<Quad>(m, 0));
    std::vector<Quad> r(m);
    const auto at = [](int i, int j) { return static_cast<std::size_t>(i * n2 + j); };
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        r[at(i, j)] = -Q_[i][j];  // A X + X B - X S X = (A - X S) X + X B
        for (int k = 0; k < n1; ++k) {
          L[at(i, j)][at(k, j)] += left[i][k];
          r[at(i, j)] -= left[i][k] * X_[k][j];
        }
        for (int k = 0; k < n2; ++k) {
          L[at(i, j)][at(i, k)] += right[k][j];
          r[at(i, j)] -= X_[i][k] * B_[k][j];
        }
      }
    }
    if (!eliminate(L, r)) return false;
    Quad moved = 0;
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        X_[i][j] += r[at(i, j)];
        const Quad share = magnitude(r[at(i, j)]), size = magnitude(X_[i][j]);
        if (size > 0 && share / size > moved) moved = share / size;
      }
    }
    converged_ = moved < Quad(1e-26L);
    return true;
  }

  Quad A_[n1][n1], B_[n2][n2], Q_[n1][n2], S_[n2][n1], X_[n1][n2];
  bool converged_ = false;
};

}  // namespace algebraic
