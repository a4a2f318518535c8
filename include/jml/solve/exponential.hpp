// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matrix exponentials of short steps: e^H and φ(H) c = ∫₀¹ e^{Hs} c ds, the state of ż = H z + c after
/// time 1.
///
/// Diagonal Padé approximants of degree 3, 5 or 7 (Higham 2005, SIAM J. Matrix Anal. Appl. 26) to rounding
/// for a norm of at most 0.95. With r = N/D and the odd part U = H W of N, φ(H) c = 2 D⁻¹ W c. D is within
/// 0.61 of the identity, hence diagonally dominant by columns: no pivoting. So all of it commutes with a
/// diagonal scaling of H: it is the norm of the *balanced* H that counts, and H itself need not be scaled.
#pragma once

#include <jml/kernels.hpp>

namespace jml::kernel {

/// The largest norm that exponential() serves to rounding.
inline constexpr double exponential_reach = 0.95;

/// d = L U in place without pivoting, for a d that is diagonally dominant by columns; U's diagonal inverted.
template <typename Scalar, int m>
[[gnu::always_inline]] inline void factor_dominant(Matrix<Scalar, m, m>& d) {
  repeat<m, 4>([&](int k) __attribute__((always_inline)) {
    const Scalar inverse = Scalar(1) / d(k, k);
    d(k, k) = inverse;
    for (int i = k + 1; i < m; ++i) d(i, k) *= inverse;
    for (int j = k + 1; j < m; ++j) {
      for (int i = k + 1; i < m; ++i) d(i, j) -= d(i, k) * d(k, j);
    }
  });
}

/// b := b (L U)⁻¹ for m×m b: whole columns, of one length.
template <typename Scalar, int m>
[[gnu::always_inline]] inline void right_solve_dominant(const Matrix<Scalar, m, m>& lu,
                                                        Matrix<Scalar, m, m>& b) {
  repeat<m, 4>([&](int j) __attribute__((always_inline)) {
    for (int k = 0; k < j; ++k) {
      for (int i = 0; i < m; ++i) b(i, j) -= b(i, k) * lu(k, j);
    }
    for (int i = 0; i < m; ++i) b(i, j) *= lu(j, j);
  });
  repeat<m, 4>([&](int l) __attribute__((always_inline)) {
    const int j = m - 1 - l;
    for (int k = j + 1; k < m; ++k) {
      for (int i = 0; i < m; ++i) b(i, j) -= b(i, k) * lu(k, j);
    }
  });
}

/// b := (L U)⁻¹ b.
template <typename Scalar, int m>
[[gnu::always_inline]] inline void solve_dominant(const Matrix<Scalar, m, m>& lu, Vector<Scalar, m>& b) {
  for (int k = 0; k < m; ++k) {
    for (int i = k + 1; i < m; ++i) b(i) -= lu(i, k) * b(k);
  }
  for (int k = m - 1; k >= 0; --k) {
    b(k) *= lu(k, k);
    for (int i = 0; i < k; ++i) b(i) -= lu(i, k) * b(k);
  }
}

/// E = e^H, m×m, and v = φ(H) c, m. `norm`: of H after balancing, at most exponential_reach.
template <typename Scalar, int m>
inline void exponential(const Matrix<Scalar, m, m>& H, const Vector<Scalar, m>& c, Scalar norm,
                        Matrix<Scalar, m, m>& E, Vector<Scalar, m>& v) {
  using Square = Matrix<Scalar, m, m>;
  constexpr bool is_float = std::numeric_limits<Scalar>::digits < 30;
  const int degree = norm <= Scalar(is_float ? 0.42 : 1.4e-2) ? 3
                     : norm <= Scalar(is_float ? 1.8 : 0.25)  ? 5
                                                              : 7;
  // Coefficients of the numerator over that of degree 0.
  static constexpr Scalar b3[4] = {1, Scalar(0.5), Scalar(0.1), Scalar(1.0 / 120)};
  static constexpr Scalar b5[6] = {
      1, Scalar(0.5), Scalar(1.0 / 9), Scalar(1.0 / 72), Scalar(1.0 / 1008), Scalar(1.0 / 30240)};
  static constexpr Scalar b7[8] = {1,
                                   Scalar(0.5),
                                   Scalar(1995840.0 / 17297280),
                                   Scalar(277200.0 / 17297280),
                                   Scalar(25200.0 / 17297280),
                                   Scalar(1512.0 / 17297280),
                                   Scalar(56.0 / 17297280),
                                   Scalar(1.0 / 17297280)};
  Square squared, even, odd, H_odd;
  product(H, H, squared);
  if (degree == 3) {
    even = b3[2] * squared;
    odd = b3[3] * squared;
  } else {
    Square fourth;
    product(squared, squared, fourth);
    if (degree == 5) {
      even = b5[2] * squared + b5[4] * fourth;
      odd = b5[3] * squared + b5[5] * fourth;
    } else {
      Square sixth;
      product(fourth, squared, sixth);
      even = b7[2] * squared + b7[4] * fourth + b7[6] * sixth;
      odd = b7[3] * squared + b7[5] * fourth + b7[7] * sixth;
    }
  }
  for (int i = 0; i < m; ++i) {
    even(i, i) += Scalar(1);
    odd(i, i) += Scalar(0.5);
  }
  product(H, odd, H_odd);
  product(odd, c, v);
  v *= Scalar(2);
  E = even + H_odd;
  even -= H_odd;  // the denominator, which commutes with the numerator
  factor_dominant(even);
  right_solve_dominant(even, E);
  solve_dominant(even, v);
}

}  // namespace jml::kernel
