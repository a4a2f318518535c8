// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How far a solution of an algebraic Riccati equation is from the true one, entry by entry.
///
/// X + Z is a solution where 0 = A₀ Z + Z B₀ + R - Z S Z, with A₀ = A - X S, B₀ = B - S X and R the residual
/// of X. With L⁻¹ the inverse of -(A₀ Z + Z B₀), |Z| ≤ |L⁻¹|(|R| + |Z||S||Z|). A sum over the powers of
/// Cayley transforms bounds |L⁻¹| from above:
///   L⁻¹ R = Σ_i F^i (2γ (γ - A₀)⁻¹ R (γ - B₀)⁻¹) E^i,  F = (γ - A₀)⁻¹(γ + A₀),  E = (γ - B₀)⁻¹(γ + B₀),
/// doubled: T⁺ = T + |F| T |E|, F⁺ = F², E⁺ = E². Entries, so that no unit of the states has a part in it.
///
/// With z = |L⁻¹||R| and |L⁻¹|(z|S|z) ≤ q z, c z with c = 2/(1 + √(1 - 4q)) is mapped below itself where
/// q ≤ 1/4: a solution is within it (Brouwer). Beyond, the next solution is nearer than the linear bound, and
/// Z grows with the root of R: c = 1/√q takes both together at q = 1/4.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>
#include <jml/riccati/algebraic_equation.hpp>
#include <jml/solve/elimination.hpp>

namespace jml::detail {

template <typename Scalar, int n1, int n2>
class AlgebraicError {
 public:
  /// About X, in balanced coordinates.
  JML_NOINLINE AlgebraicError(const RiccatiBlocks<Scalar, n1, n2>& k, const Matrix<Scalar, n1, n2>& X)
      : S_(kernel::absolute(k.S)) {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    Matrix<Scalar, n1, n1> A0;
    Matrix<Scalar, n2, n2> B0;
    Matrix<Scalar, n1, n2> R;
    k.residual(X, A0, B0, R);
    // |R| + ε (|A||X| + |X||B| + |Q| + |X||S||X|)
    const Matrix<Scalar, n1, n2> x = kernel::absolute(X);
    Matrix<Scalar, n2, n2> right = kernel::absolute(k.B);
    kernel::accumulate(S_, x, right);
    weight_ = kernel::absolute(k.Q);
    kernel::accumulate(Matrix<Scalar, n1, n1>(kernel::absolute(k.A)), x, weight_);
    kernel::accumulate(x, right, weight_);
    weight_ = kernel::absolute(k.accurate_residual(X)) + epsilon * weight_;

    const Scalar largest_a = kernel::largest(A0), largest_b = kernel::largest(B0);
    const Scalar floor = Scalar(1e-4) * (largest_a > largest_b ? largest_a : largest_b);
    gamma_ = std::sqrt(kernel::mean_modulus(A0, floor) * kernel::mean_modulus(B0, floor));
    valid_ = gamma_ > Scalar(0) && inverse_of(A0, left_) && inverse_of(B0, right_);
  }

  /// |Z| where every coefficient's last digit is in doubt, and X not solved better than to its residual;
  /// false where there is no bound.
  [[nodiscard]] bool bound(Matrix<Scalar, n1, n2>& Z) const {
    constexpr Scalar most = Scalar(0.25);
    Matrix<Scalar, n2, n2> SZ;
    Matrix<Scalar, n1, n2> ZSZ, again;
    if (!valid_ || !solve(weight_, Z)) return false;
    kernel::multiply(S_, Z, SZ);
    kernel::multiply(Z, SZ, ZSZ);
    if (!solve(ZSZ, again)) return false;
    Scalar q = 0;
    for (int j = 0; j < n2; ++j) {
      for (int i = 0; i < n1; ++i) {
        if (again(i, j) > q * Z(i, j)) q = again(i, j) / Z(i, j);
      }
    }
    if (!std::isfinite(q)) return false;
    Z *=
        q <= most ? Scalar(2) / (Scalar(1) + std::sqrt(Scalar(1) - Scalar(4) * q)) : Scalar(1) / std::sqrt(q);
    return true;
  }

 private:
  template <int n>
  bool inverse_of(const Matrix<Scalar, n, n>& M, Matrix<Scalar, n, n>& inverse) const {
    Matrix<Scalar, n, n> shifted = -M;
    kernel::add_to_diagonal(shifted, gamma_);
    inverse = kernel::identity<Matrix<Scalar, n, n>>();
    return kernel::eliminate(shifted, inverse) > Scalar(0) && all_finite(inverse);
  }

  /// Z = |L⁻¹| W from above; false where the powers do not vanish.
  JML_NOINLINE bool solve(const Matrix<Scalar, n1, n2>& W, Matrix<Scalar, n1, n2>& Z) const {
    Matrix<Scalar, n1, n1> F = (Scalar(2) * gamma_) * left_, powers;
    Matrix<Scalar, n2, n2> E = (Scalar(2) * gamma_) * right_, square;
    Matrix<Scalar, n1, n2> half, more;
    kernel::multiply(Matrix<Scalar, n1, n1>(kernel::absolute(F)), W, half);
    kernel::multiply(half, Matrix<Scalar, n2, n2>(kernel::absolute(right_)), Z);
    kernel::add_to_diagonal(F, Scalar(-1));
    kernel::add_to_diagonal(E, Scalar(-1));
    for (int doubling = 0; doubling < 64; ++doubling) {
      kernel::multiply(Matrix<Scalar, n1, n1>(kernel::absolute(F)), Z, half);
      kernel::multiply(half, Matrix<Scalar, n2, n2>(kernel::absolute(E)), more);
      Z += more;
      const Scalar size = kernel::norm(Z);
      if (!std::isfinite(size)) return false;
      if (kernel::norm(more) <= Scalar(1e-2) * size &&
          kernel::norm_bound(F) * kernel::norm_bound(E) < Scalar(1))
        return true;
      kernel::multiply(F, F, powers);
      kernel::multiply(E, E, square);
      F = powers;
      E = square;
    }
    return false;
  }

  Matrix<Scalar, n2, n1> S_;
  Matrix<Scalar, n1, n2> weight_;
  Matrix<Scalar, n1, n1> left_;
  Matrix<Scalar, n2, n2> right_;
  Scalar gamma_ = 0;
  bool valid_ = false;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
