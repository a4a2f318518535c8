// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An algebraic Riccati equation and its answer, and the equation in balanced coordinates.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>
#include <jml/solve/balance.hpp>
#include <jml/solve/compensated.hpp>
#include <jml/solve/doubling.hpp>
#include <jml/status.hpp>

namespace jml {

/// The signs, each +1 or -1, of the four terms of 0 = ± A X ± X B ± Q ± X S X.
struct RiccatiSigns {
  int AX = 1;    ///< of A X
  int XB = 1;    ///< of X B
  int Q = 1;     ///< of Q
  int XSX = -1;  ///< of X S X
};

/// 0 = A X + X B + Q - X S X for an unknown X of n1×n2; none of the four needs symmetry or sign.
///
/// - Filter equation 0 = A V + V Aᵀ + GQGᵀ - V HᵀR⁻¹H V (McCaffrey 1998): {A, Aᵀ, GQGᵀ, HᵀR⁻¹H}.
/// - Steady Rusnak 2018, eq. (19): {F, f_xᵀ, GQGᵀ, m_xᵀR⁻¹M}; its P is no covariance.
/// - Control, 0 = Q + AᵀX + X A - X G X: {Aᵀ, A, Q, G}.
/// - M-matrix form X C X - A X - X D + B = 0, minimal nonnegative X: {A, D, B, C, {-1, -1, 1, 1}}.
template <typename Scalar, int n1, int n2 = n1>
struct AlgebraicRiccati {
  Matrix<Scalar, n1, n1> A;  ///< n1×n1
  Matrix<Scalar, n2, n2> B;  ///< n2×n2
  Matrix<Scalar, n1, n2> Q;  ///< n1×n2
  Matrix<Scalar, n2, n1> S;  ///< n2×n1
  RiccatiSigns signs = {};   ///< by default those of the filter equation
};

/// A solution, or why there is none.
template <typename Scalar, int n1, int n2 = n1>
struct AlgebraicSolution {
  Matrix<Scalar, n1, n2> X = kernel::zeros<Matrix<Scalar, n1, n2>>();  ///< n1×n2; zero on refusal
  Status status = Status::not_converged;  ///< ok, accepted_critical, or a refusal
  Scalar residual = 0;  ///< ‖A X + X B + Q - X S X‖ over the sum of the four terms' norms, in balanced units
  /// Claimed ‖X - true‖/‖X‖, below one: what rounding of the coefficients' last digit can do, and this solver
  /// with it. Where `shifted`, among critical equations and what was seen of neighbours: to one that is not
  /// critical by its last digit (or has no solution) X may be off by √ε.
  Scalar error = 0;
  int iterations = 0;    ///< doublings
  bool warm = false;     ///< the start sufficed, no Schur form was computed
  bool shifted = false;  ///< a double eigenvalue at the split, moved apart: X is digits better than √ε
};

namespace detail {

template <typename Scalar, int n1, int n2>
[[nodiscard]] bool valid(const AlgebraicRiccati<Scalar, n1, n2>& e) {
  const auto sign = [](int s) { return s == 1 || s == -1; };
  return all_finite(e.A) && all_finite(e.B) && all_finite(e.Q) && all_finite(e.S) && sign(e.signs.AX) &&
         sign(e.signs.XB) && sign(e.signs.Q) && sign(e.signs.XSX);
}

/// The four coefficients as they stand in K = [-B S; Q A].
template <typename Scalar, int n1, int n2>
struct RiccatiBlocks {
  Matrix<Scalar, n1, n1> A;
  Matrix<Scalar, n2, n2> B;
  Matrix<Scalar, n1, n2> Q;
  Matrix<Scalar, n2, n1> S;

  explicit RiccatiBlocks(const Matrix<Scalar, n1 + n2, n1 + n2>& K)
      : A(kernel::block<n1, n1>(K, n2, n2)),
        B(-kernel::block<n2, n2>(K, 0, 0)),
        Q(kernel::block<n1, n2>(K, n2, 0)),
        S(kernel::block<n2, n1>(K, 0, n2)) {}

  /// A₀ = A - X S, B₀ = B - S X, and the residual A₀ X + X B + Q; the answer is the sum of the terms' norms.
  JML_NOINLINE Scalar residual(const Matrix<Scalar, n1, n2>& X, Matrix<Scalar, n1, n1>& A0,
                               Matrix<Scalar, n2, n2>& B0, Matrix<Scalar, n1, n2>& R) const {
    Matrix<Scalar, n1, n2> AX, XB, XSX;
    Matrix<Scalar, n2, n2> SX;
    kernel::multiply(S, X, SX);            // S X
    kernel::add_product<-1>(A, X, S, A0);  // A₀ = A - X S
    B0 = B - SX;
    kernel::multiply(A, X, AX);    // A X
    kernel::multiply(X, B, XB);    // X B
    kernel::multiply(X, SX, XSX);  // X S X
    R = (AX + Q) + (XB - XSX);
    return kernel::norm(AX) + kernel::norm(XB) + kernel::norm(Q) + kernel::norm(XSX);
  }

  /// How much the four terms move when the coefficients move by one, relative to their norms.
  [[nodiscard]] Scalar weight(const Matrix<Scalar, n1, n2>& X) const {
    const Scalar x = kernel::norm(X);
    return (kernel::norm(A) + kernel::norm(B) + x * kernel::norm(S)) * x + kernel::norm(Q);
  }

  /// The residual in twice the working precision, rounded once.
  JML_NOINLINE Matrix<Scalar, n1, n2> accurate_residual(const Matrix<Scalar, n1, n2>& X) const {
    using Sum = kernel::CompensatedSum<Scalar>;
    Matrix<Scalar, n2, n2> high, low;  // B - S X
    for (int j = 0; j < n2; ++j) {
      for (int i = 0; i < n2; ++i) {
        Sum sum;
        sum.add(B(i, j));
        for (int k = 0; k < n1; ++k) sum.add_product(-S(i, k), X(k, j));
        high(i, j) = sum.value();
        low(i, j) = sum.rest();
      }
    }
    Matrix<Scalar, n1, n2> R;
    for (int j = 0; j < n2; ++j) {
      for (int i = 0; i < n1; ++i) {
        Sum sum;
        sum.add(Q(i, j));
        for (int k = 0; k < n1; ++k) sum.add_product(A(i, k), X(k, j));
        for (int k = 0; k < n2; ++k) sum.add_product(X(i, k), high(k, j));
        for (int k = 0; k < n2; ++k) sum.add_product(X(i, k), low(k, j));
        R(i, j) = sum.value();
      }
    }
    return R;
  }
};

/// K in balanced coordinates; X there is D1⁻¹ X D2.
template <typename Scalar, int n1, int n2>
struct BalancedRiccati {
  static constexpr int m = n1 + n2;
  Matrix<Scalar, m, m> K;
  Vector<Scalar, m> scale;

  explicit BalancedRiccati(const AlgebraicRiccati<Scalar, n1, n2>& e) {
    kernel::set_block(K, n2, n2, Scalar(e.signs.AX) * e.A);
    kernel::set_block(K, 0, 0, Scalar(-e.signs.XB) * e.B);
    kernel::set_block(K, n2, 0, Scalar(e.signs.Q) * e.Q);
    kernel::set_block(K, 0, n2, Scalar(-e.signs.XSX) * e.S);
    // One factor for X as a whole first: balance() sees none where Q or S is zero.
    const Scalar q = kernel::largest(e.Q), s = kernel::largest(e.S);
    const Scalar a = kernel::largest(e.A) + kernel::largest(e.B);
    const Scalar up = q > Scalar(0) ? q : a, down = s > Scalar(0) ? s : a;
    int exponent = 0;
    if (up > Scalar(0) && down > Scalar(0) && std::isfinite(up + down) && (q > Scalar(0) || s > Scalar(0))) {
      exponent = std::ilogb(up) - std::ilogb(down);
      if (q > Scalar(0) && s > Scalar(0)) exponent /= 2;
    }
    const Scalar factor = std::ldexp(Scalar(1), exponent);
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        K(n2 + i, j) /= factor;
        K(j, n2 + i) *= factor;
      }
    }
    scale = kernel::balance(K);
    for (int i = 0; i < n1; ++i) scale(n2 + i) *= factor;
  }

  [[nodiscard]] Matrix<Scalar, n1, n2> into(const Matrix<Scalar, n1, n2>& X) const {
    return kernel::scaled_by(kernel::inverse_of_entries(of_rows()), X, of_columns());
  }
  [[nodiscard]] Matrix<Scalar, n1, n2> out_of(const Matrix<Scalar, n1, n2>& X) const {
    return kernel::scaled_by(of_rows(), X, kernel::inverse_of_entries(of_columns()));
  }
  /// What one unit of X here can be at most there.
  [[nodiscard]] Scalar unit() const {
    return kernel::largest(of_rows()) * kernel::largest(kernel::inverse_of_entries(of_columns()));
  }

 private:
  [[nodiscard]] Vector<Scalar, n1> of_rows() const { return kernel::block<n1, 1>(scale, n2, 0); }
  [[nodiscard]] Vector<Scalar, n2> of_columns() const { return kernel::block<n2, 1>(scale, 0, 0); }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
