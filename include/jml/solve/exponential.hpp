// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matrix exponentials of short steps, with what a constant and a ramp do on the way: the state of
/// ż = H z + c + r s after time 1 is e^H z + φ₁(H) c + φ₂(H) r.
///
/// Diagonal Padé approximants N/D of degree 3, 5 or 7 (Higham 2005, SIAM J. Matrix Anal. Appl. 26) to
/// rounding for a norm of at most 0.95. With N = even + H odd, D = even - H odd: φ₁ = 2 D⁻¹ odd, and φ₂ = D⁻¹
/// (odd + (2 odd - even) H⁻¹), a polynomial too. D is within 0.61 of the identity, hence diagonally dominant
/// by columns: no pivoting. So all of it commutes with a diagonal scaling of H: it is the norm of the
/// *balanced* H that counts, and H itself need not be scaled.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>

namespace jml::kernel {

/// The largest norm that Exponential serves to rounding.
inline constexpr double exponential_reach = 0.95;

/// d = L U in place without pivoting, for a d that is diagonally dominant by columns; U's diagonal inverted.
template <typename Scalar, int m>
JML_INLINE inline void factor_dominant(Matrix<Scalar, m, m>& d) {
  repeat<m, 4>([&](int k) JML_INLINE {
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
JML_INLINE inline void right_solve_dominant(const Matrix<Scalar, m, m>& lu, Matrix<Scalar, m, m>& b) {
  repeat<m, 4>([&](int j) JML_INLINE {
    for (int k = 0; k < j; ++k) {
      for (int i = 0; i < m; ++i) b(i, j) -= b(i, k) * lu(k, j);
    }
    for (int i = 0; i < m; ++i) b(i, j) *= lu(j, j);
  });
  repeat<m, 4>([&](int l) JML_INLINE {
    const int j = m - 1 - l;
    for (int k = j + 1; k < m; ++k) {
      for (int i = 0; i < m; ++i) b(i, j) -= b(i, k) * lu(k, j);
    }
  });
}

/// b := (L U)⁻¹ b.
template <typename Scalar, int m>
JML_INLINE inline void solve_dominant(const Matrix<Scalar, m, m>& lu, Vector<Scalar, m>& b) {
  for (int k = 0; k < m; ++k) {
    for (int i = k + 1; i < m; ++i) b(i) -= lu(i, k) * b(k);
  }
  for (int k = m - 1; k >= 0; --k) {
    b(k) *= lu(k, k);
    for (int i = 0; i < k; ++i) b(i) -= lu(i, k) * b(k);
  }
}

/// e^H and its φ-functions for one m×m H. `norm`: of H after balancing, at most exponential_reach.
template <typename Scalar, int m>
class Exponential {
 public:
  using Square = Matrix<Scalar, m, m>;
  using Column = Vector<Scalar, m>;

  Exponential(const Square& H, Scalar norm) : H_(H) {
    constexpr bool is_float = std::numeric_limits<Scalar>::digits < 30;
    const int degree = norm <= Scalar(is_float ? 0.42 : 1.4e-2) ? 3
                       : norm <= Scalar(is_float ? 1.8 : 0.25)  ? 5
                                                                : 7;
    coefficients_ = degree == 3 ? b3 : degree == 5 ? b5 : b7;
    const Scalar* b = coefficients_;
    product(H, H, squared_);  // H²
    Square lu = b[2] * squared_;
    odd_ = b[3] * squared_;
    if (degree > 3) {
      product(squared_, squared_, fourth_);  // H⁴
      lu += b[4] * fourth_;
      odd_ += b[5] * fourth_;
    } else {
      kernel::set_zero(fourth_);
    }
    if (degree > 5) {
      Square sixth;
      product(fourth_, squared_, sixth);  // H⁶
      lu += b[6] * sixth;
      odd_ += b[7] * sixth;
    }
    for (int i = 0; i < m; ++i) {
      lu(i, i) += Scalar(1);
      odd_(i, i) += Scalar(0.5);
    }
    Square H_odd;
    product(H, odd_, H_odd);  // H odd
    value_ = lu + H_odd;
    lu -= H_odd;  // the denominator, which commutes with the numerator
    factor_dominant(lu);
    right_solve_dominant(lu, value_);  // e^H = N D⁻¹
    lu_ = lu;
  }

  /// e^H.
  [[nodiscard]] const Square& value() const { return value_; }

  /// φ₁(H) c = ∫₀¹ e^{Hs} c ds.
  [[nodiscard]] Column phi1(const Column& c) const {
    Column out;
    product(odd_, c, out);  // odd c
    out *= Scalar(2);
    solve_dominant(lu_, out);
    return out;
  }

  /// φ₂(H) r = ∫₀¹ e^{H(1-s)} s r ds.
  [[nodiscard]] Column phi2(const Column& r) const {
    const Scalar* b = coefficients_;
    Column squared_r, fourth_r, out;
    product(squared_, r, squared_r);  // H² r
    product(fourth_, r, fourth_r);    // H⁴ r
    const Column inner = (2 * b[3] - b[2]) * r + (2 * b[5] - b[4]) * squared_r + (2 * b[7] - b[6]) * fourth_r;
    product(odd_, r, out);                // odd r
    add_product<1>(out, H_, inner, out);  // (odd + (2 odd - even) H⁻¹) r
    solve_dominant(lu_, out);
    return out;
  }

 private:
  // Of the numerator, over that of degree 0.
  static constexpr Scalar b3[8] = {1, Scalar(0.5), Scalar(0.1), Scalar(1.0 / 120)};
  static constexpr Scalar b5[8] = {
      1, Scalar(0.5), Scalar(1.0 / 9), Scalar(1.0 / 72), Scalar(1.0 / 1008), Scalar(1.0 / 30240)};
  static constexpr Scalar b7[8] = {1,
                                   Scalar(0.5),
                                   Scalar(1995840.0 / 17297280),
                                   Scalar(277200.0 / 17297280),
                                   Scalar(25200.0 / 17297280),
                                   Scalar(1512.0 / 17297280),
                                   Scalar(56.0 / 17297280),
                                   Scalar(1.0 / 17297280)};

  const Square& H_;
  const Scalar* coefficients_;
  Square squared_, fourth_, odd_, lu_, value_;
};

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
