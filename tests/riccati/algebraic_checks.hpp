// SPDX-License-Identifier: BSD-3-Clause
// What the tests of the algebraic Riccati solvers measure, in long double and from the equation alone.
#pragma once

#include <Eigen/LU>
#include <jml/riccati/algebraic.hpp>

#include "models/linear.hpp"

namespace algebraic {

using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

template <typename Derived>
Long longer(const Eigen::MatrixBase<Derived>& m) {
  return m.template cast<long double>();
}

/// ‖A X + X B + Q - X S X‖ over the sum of the four terms' norms.
template <typename Scalar, int n1, int n2>
double relative_residual(const jml::AlgebraicRiccati<Scalar, n1, n2>& e,
                         const jml::Matrix<Scalar, n1, n2>& X) {
  const Long x = longer(X), AX = e.signs.AX * longer(e.A) * x, XB = e.signs.XB * x * longer(e.B);
  const Long Q = e.signs.Q * longer(e.Q), XSX = e.signs.XSX * x * longer(e.S) * x;
  return static_cast<double>((AX + XB + Q + XSX).norm() / (AX.norm() + XB.norm() + Q.norm() + XSX.norm()));
}

/// All eigenvalues in the left half plane: the powers of the Cayley transform (I - M)⁻¹(I + M) vanish.
inline bool is_stable(const Long& M) {
  const Long I = Long::Identity(M.rows(), M.cols());
  const long double scale = M.norm();
  Long C = (I * scale - M).partialPivLu().solve(I * scale + M);
  for (int k = 0; k < 40 && C.norm() > 1e-3L && C.norm() < 1e30L; ++k) C = (C * C).eval();
  return C.norm() <= 1e-3L;
}

/// The definition of the stabilising solution.
template <typename Scalar, int n1, int n2>
bool stabilizes(const jml::AlgebraicRiccati<Scalar, n1, n2>& e, const jml::Matrix<Scalar, n1, n2>& X) {
  const Long x = longer(X), S = -e.signs.XSX * longer(e.S);
  return is_stable(e.signs.AX * longer(e.A) - x * S) && is_stable(e.signs.XB * longer(e.B) - S * x);
}

template <typename A, typename B>
double distance(const Eigen::MatrixBase<A>& got, const Eigen::MatrixBase<B>& wanted) {
  return static_cast<double>((longer(got) - longer(wanted)).norm() / longer(wanted).norm());
}

/// The equation that X solves with A - X S = left and B - S X = right: Q is what is left over. With small
/// integers it is exact.
template <typename Scalar, int n1, int n2>
jml::AlgebraicRiccati<Scalar, n1, n2> with_solution(const jml::Matrix<Scalar, n1, n2>& X,
                                                    const jml::Matrix<Scalar, n2, n1>& S,
                                                    const jml::Matrix<Scalar, n1, n1>& left,
                                                    const jml::Matrix<Scalar, n2, n2>& right) {
  jml::AlgebraicRiccati<Scalar, n1, n2> e{left + X * S, right + S * X, {}, S};
  e.Q = -(left * X + X * right + X * S * X);
  return e;
}

/// Negative definite symmetric part: stable.
template <int n>
jml::Matrix<double, n, n> random_stable(jml::Noise& noise) {
  const jml::Matrix<double, n, n> M = models::random_matrix<n, n>(noise),
                                  W = models::random_matrix<n, n>(noise);
  return W - W.transpose() - M * M.transpose() / n - 0.1 * jml::Matrix<double, n, n>::Identity();
}

/// A filter equation of n states, (n+1)/2 disturbances and measurements; F is as often unstable as stable.
template <int n>
jml::AlgebraicRiccati<double, n> random_filter(jml::Noise& noise) {
  constexpr int p = (n + 1) / 2;
  const auto F = models::random_matrix<n, n>(noise);
  const auto G = models::random_matrix<n, p>(noise);
  const auto M = models::random_matrix<p, n>(noise);
  const jml::Matrix<double, n, n> Q = G * G.transpose(), S = M.transpose() * M;
  return {F, jml::kernel::transposed(F), (Q + Q.transpose()) / 2, (S + S.transpose()) / 2};
}

}  // namespace algebraic
